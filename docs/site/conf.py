# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sphinx's settings of the documentation's site (`make docs`)."""

project = 'engb_ros'
author = 'engb_ros maintainers'
copyright = 'engb_ros maintainers, Apache-2.0'     # noqa: A001
extensions = ['sphinx.ext.autodoc', 'sphinx.ext.napoleon', 'sphinx.ext.viewcode', 'myst_parser']
source_suffix = {'.md': 'markdown', '.rst': 'restructuredtext'}
root_doc = 'index'
myst_enable_extensions = ['dollarmath']
myst_heading_anchors = 3
autodoc_typehints = 'description'
autodoc_member_order = 'bysource'
napoleon_use_ivar = True
html_theme = 'alabaster'
html_theme_options = {'description': 'what physics a brake model leaves out',
                      'fixed_sidebar': True, 'page_width': '960px'}
# What stands between single backticks is code.
default_role = 'code'


def _plain_bars(app, what, name, thing, options, lines):
    """Let |ω| be a magnitude, not a substitution."""
    lines[:] = [line.replace('|', '\\|') for line in lines]


def setup(app):
    """Register what happens to docstrings."""
    app.connect('autodoc-process-docstring', _plain_bars)

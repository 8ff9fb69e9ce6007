"""The paper's experiments, figures and numbers, made again."""

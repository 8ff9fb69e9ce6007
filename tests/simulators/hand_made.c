/* Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0 */
/*
 * An FMI 2.0 co-simulation unit as somebody writes it by hand: a motor with a spring behind a gap
 * of free travel. Nothing of it comes from `engb export`. The integrator is semi-implicit Euler at
 * 20 kHz with dry friction as a set-valued force. The numbers are given when it is compiled.
 */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

typedef void *Component;
typedef unsigned int Reference;

typedef struct {
    double tau, angle, speed, time;
} Machine;

enum { OK = 0, ERROR = 3 };

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
Component fmi2Instantiate(const char *name, int kind, const char *guid, const char *resources,
                          const void *callbacks, int visible, int logging)
{
    (void)name; (void)kind; (void)guid; (void)resources; (void)callbacks; (void)visible;
    (void)logging;
    return calloc(1, sizeof(Machine));
}
void fmi2FreeInstance(Component unit) { free(unit); }
int fmi2SetDebugLogging(Component unit, int on, size_t count, const char *const *categories)
{
    (void)unit; (void)on; (void)count; (void)categories;
    return OK;
}
int fmi2SetupExperiment(Component unit, int defined, double tolerance, double start, int stops,
                        double stop)
{
    (void)defined; (void)tolerance; (void)stops; (void)stop;
    ((Machine *)unit)->time = start;
    return OK;
}
int fmi2EnterInitializationMode(Component unit) { (void)unit; return OK; }
int fmi2ExitInitializationMode(Component unit) { (void)unit; return OK; }
int fmi2Terminate(Component unit) { (void)unit; return OK; }
int fmi2Reset(Component unit) { *(Machine *)unit = (Machine){0.0, 0.0, 0.0, 0.0}; return OK; }

static double *place(Component unit, Reference reference)
{
    Machine *machine = unit;
    double *places[] = {&machine->tau, &machine->angle, &machine->speed};
    return reference < 3u ? places[reference] : NULL;
}
int fmi2GetReal(Component unit, const Reference *references, size_t count, double *values)
{
    for (size_t k = 0; k < count; ++k) {
        const double *from = place(unit, references[k]);
        if (!from) return ERROR;
        values[k] = *from;
    }
    return OK;
}
int fmi2SetReal(Component unit, const Reference *references, size_t count, const double *values)
{
    for (size_t k = 0; k < count; ++k) {
        double *to = place(unit, references[k]);
        if (!to) return ERROR;
        *to = values[k];
    }
    return OK;
}
#define NONE(name, type) \
    int name(Component unit, const Reference *references, size_t count, type *values) \
    { (void)unit; (void)references; (void)values; return count ? ERROR : OK; }
NONE(fmi2GetInteger, int)
NONE(fmi2SetInteger, const int)
NONE(fmi2GetBoolean, int)
NONE(fmi2SetBoolean, const int)
NONE(fmi2GetString, const char *)
NONE(fmi2SetString, const char *const)

int fmi2DoStep(Component unit, double now, double length, int kept)
{
    Machine *machine = unit;
    const long steps = (long)ceil(length / 5e-5 - 1e-9);
    const double step = length / (double)steps;
    (void)kept;
    for (long k = 0; k < steps; ++k) {
        const double travel = machine->angle > CONTACT ? machine->angle - CONTACT : 0.0;
        const double load = travel * (LOAD_1 + travel * (LOAD_2 + travel * LOAD_3));
        const double free_speed = machine->speed
            + step * (machine->tau - DAMPING * machine->speed - load) / INERTIA;
        const double most = step * FRICTION / INERTIA;
        machine->speed = fabs(free_speed) <= most ? 0.0 : free_speed - copysign(most, free_speed);
        machine->angle += step * machine->speed;
    }
    machine->time = now + length;
    return OK;
}
/* What it does not offer; who runs it wants the names. */
#define MISSING(name) int name(Component unit) { (void)unit; return ERROR; }
MISSING(fmi2CancelStep)
MISSING(fmi2GetFMUstate)
MISSING(fmi2SetFMUstate)
MISSING(fmi2FreeFMUstate)
MISSING(fmi2SerializedFMUstateSize)
MISSING(fmi2SerializeFMUstate)
MISSING(fmi2DeSerializeFMUstate)
MISSING(fmi2GetDirectionalDerivative)
MISSING(fmi2SetRealInputDerivatives)
MISSING(fmi2GetRealOutputDerivatives)
MISSING(fmi2GetStatus)
MISSING(fmi2GetRealStatus)
MISSING(fmi2GetIntegerStatus)
MISSING(fmi2GetBooleanStatus)
MISSING(fmi2GetStringStatus)

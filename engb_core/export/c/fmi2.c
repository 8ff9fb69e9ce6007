/* Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0 */
/* FMI 2.0 for co-simulation, around engb_plant. Types as the standard's headers give them. */
#include "fmu_instance.h"

typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef void *fmi2Component;
typedef unsigned int fmi2ValueReference;
typedef const char *fmi2String;
typedef int fmi2Boolean;

ENGB_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
ENGB_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

ENGB_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count,
                                           const fmi2String categories[])
{
    (void)c; (void)on; (void)count; (void)categories;
    return fmi2OK;
}

ENGB_EXPORT fmi2Component fmi2Instantiate(fmi2String name, int type, fmi2String guid,
                                          fmi2String resources, const void *callbacks,
                                          fmi2Boolean visible, fmi2Boolean logging)
{
    (void)name; (void)resources; (void)callbacks; (void)visible; (void)logging;
    /* 1: co-simulation. */
    return type == 1 ? engb_make(guid) : NULL;
}

ENGB_EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

ENGB_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined,
                                           double tolerance, double start,
                                           fmi2Boolean stop_defined, double stop)
{
    (void)tolerance_defined; (void)tolerance; (void)stop_defined; (void)stop;
    OF(c)->time = start;
    return fmi2OK;
}

ENGB_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

ENGB_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    engb_begin(OF(c));
    return fmi2OK;
}

ENGB_EXPORT fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
ENGB_EXPORT fmi2Status fmi2Reset(fmi2Component c) { engb_reset(OF(c)); return fmi2OK; }

ENGB_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[],
                                   size_t count, double values[])
{
    return engb_get(OF(c), references, count, values) ? fmi2OK : fmi2Error;
}

ENGB_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[],
                                   size_t count, const double values[])
{
    return engb_set(OF(c), references, count, values) ? fmi2OK : fmi2Error;
}

/* There are no variables but real ones: nothing asked for is fine. */
#define OTHER(name, kind) \
    ENGB_EXPORT fmi2Status name(fmi2Component c, const fmi2ValueReference references[], \
                                size_t count, kind values[]) \
    { \
        (void)c; (void)references; (void)values; \
        return count == 0 ? fmi2OK : fmi2Error; \
    }
OTHER(fmi2GetInteger, int)
OTHER(fmi2GetBoolean, fmi2Boolean)
OTHER(fmi2GetString, fmi2String)
OTHER(fmi2SetInteger, const int)
OTHER(fmi2SetBoolean, const fmi2Boolean)
OTHER(fmi2SetString, const fmi2String)

ENGB_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, void **state)
{
    return engb_keep(OF(c), state) ? fmi2OK : fmi2Error;
}

ENGB_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, void *state)
{
    memcpy(c, state, sizeof(engb_instance));
    return fmi2OK;
}

ENGB_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, void **state)
{
    (void)c;
    engb_forget(state);
    return fmi2OK;
}

ENGB_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, void *state, size_t *size)
{
    (void)c; (void)state;
    *size = sizeof(engb_instance);
    return fmi2OK;
}

ENGB_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, void *state, char bytes[],
                                             size_t size)
{
    (void)c;
    return engb_write(state, bytes, size) ? fmi2OK : fmi2Error;
}

ENGB_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const char bytes[], size_t size,
                                               void **state)
{
    (void)c;
    return engb_read(bytes, size, state) ? fmi2OK : fmi2Error;
}

ENGB_EXPORT fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
    const fmi2ValueReference known[], size_t knowns, const double change[], double result[])
{
    (void)c; (void)unknown; (void)unknowns; (void)known; (void)knowns; (void)change;
    (void)result;
    return fmi2Error;
}

ENGB_EXPORT fmi2Status fmi2SetRealInputDerivatives(
    fmi2Component c, const fmi2ValueReference references[], size_t count, const int orders[],
    const double values[])
{
    (void)c; (void)references; (void)orders; (void)values;
    return count == 0 ? fmi2OK : fmi2Error;
}

ENGB_EXPORT fmi2Status fmi2GetRealOutputDerivatives(
    fmi2Component c, const fmi2ValueReference references[], size_t count, const int orders[],
    double values[])
{
    (void)c; (void)references; (void)orders; (void)values;
    return count == 0 ? fmi2OK : fmi2Error;
}

ENGB_EXPORT fmi2Status fmi2DoStep(fmi2Component c, double time, double duration, fmi2Boolean last)
{
    (void)time; (void)last;
    return engb_step(OF(c), duration) ? fmi2OK : fmi2Error;
}

ENGB_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }

/* Steps are done when fmi2DoStep returns: there is nothing to be asked. */
#define STATUS(name, kind) \
    ENGB_EXPORT fmi2Status name(fmi2Component c, int what, kind *value) \
    { \
        (void)c; (void)what; (void)value; \
        return fmi2Discard; \
    }
STATUS(fmi2GetStatus, fmi2Status)
STATUS(fmi2GetRealStatus, double)
STATUS(fmi2GetIntegerStatus, int)
STATUS(fmi2GetBooleanStatus, fmi2Boolean)
STATUS(fmi2GetStringStatus, fmi2String)

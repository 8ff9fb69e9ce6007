/* Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0 */
/* FMI 3.0 for co-simulation, around engb_plant. Types as the standard's headers give them. */
#include "fmu_instance.h"

#include <stdbool.h>
#include <stdint.h>

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void *fmi3Instance;
typedef uint32_t fmi3ValueReference;
typedef const char *fmi3String;

ENGB_EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

ENGB_EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, bool on, size_t count,
                                           const fmi3String categories[])
{
    (void)c; (void)on; (void)count; (void)categories;
    return fmi3OK;
}

ENGB_EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, bool visible, bool logging,
    bool events, bool early, const fmi3ValueReference wanted[], size_t wanted_count,
    void *environment, void (*log_message)(void), void (*update)(void))
{
    (void)name; (void)resources; (void)visible; (void)logging; (void)events; (void)early;
    (void)wanted; (void)wanted_count; (void)environment; (void)log_message; (void)update;
    return engb_make(token);
}

/* Neither model exchange nor scheduled execution. */
ENGB_EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name)
{
    (void)name;
    return NULL;
}

ENGB_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name)
{
    (void)name;
    return NULL;
}

ENGB_EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }

ENGB_EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, bool tolerance_defined,
                                                   double tolerance, double start,
                                                   bool stop_defined, double stop)
{
    (void)tolerance_defined; (void)tolerance; (void)stop_defined; (void)stop;
    OF(c)->time = start;
    return fmi3OK;
}

ENGB_EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    engb_begin(OF(c));
    return fmi3OK;
}

ENGB_EXPORT fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }
ENGB_EXPORT fmi3Status fmi3Reset(fmi3Instance c) { engb_reset(OF(c)); return fmi3OK; }

ENGB_EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference references[],
                                      size_t count, double values[], size_t values_count)
{
    return values_count >= count && engb_get(OF(c), references, count, values) ? fmi3OK
                                                                               : fmi3Error;
}

ENGB_EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference references[],
                                      size_t count, const double values[], size_t values_count)
{
    return values_count >= count && engb_set(OF(c), references, count, values) ? fmi3OK
                                                                               : fmi3Error;
}

/* There are no variables but those of Float64: nothing asked for is fine. */
#define OTHER(name, kind) \
    ENGB_EXPORT fmi3Status fmi3Get##name(fmi3Instance c, const fmi3ValueReference references[], \
                                         size_t count, kind values[], size_t values_count) \
    { \
        (void)c; (void)references; (void)values; (void)values_count; \
        return count == 0 ? fmi3OK : fmi3Error; \
    } \
    ENGB_EXPORT fmi3Status fmi3Set##name(fmi3Instance c, const fmi3ValueReference references[], \
                                         size_t count, const kind values[], size_t values_count) \
    { \
        (void)c; (void)references; (void)values; (void)values_count; \
        return count == 0 ? fmi3OK : fmi3Error; \
    }
OTHER(Float32, float)
OTHER(Int8, int8_t)
OTHER(UInt8, uint8_t)
OTHER(Int16, int16_t)
OTHER(UInt16, uint16_t)
OTHER(Int32, int32_t)
OTHER(UInt32, uint32_t)
OTHER(Int64, int64_t)
OTHER(UInt64, uint64_t)
OTHER(Boolean, bool)
OTHER(String, fmi3String)

ENGB_EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, void **state)
{
    return engb_keep(OF(c), state) ? fmi3OK : fmi3Error;
}

ENGB_EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, void *state)
{
    memcpy(c, state, sizeof(engb_instance));
    return fmi3OK;
}

ENGB_EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, void **state)
{
    (void)c;
    engb_forget(state);
    return fmi3OK;
}

ENGB_EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, void *state, size_t *size)
{
    (void)c; (void)state;
    *size = sizeof(engb_instance);
    return fmi3OK;
}

ENGB_EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance c, void *state, uint8_t bytes[],
                                             size_t size)
{
    (void)c;
    return engb_write(state, bytes, size) ? fmi3OK : fmi3Error;
}

ENGB_EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const uint8_t bytes[], size_t size,
                                               void **state)
{
    (void)c;
    return engb_read(bytes, size, state) ? fmi3OK : fmi3Error;
}

ENGB_EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance c) { (void)c; return fmi3OK; }

ENGB_EXPORT fmi3Status fmi3DoStep(fmi3Instance c, double time, double duration, bool no_return,
                                  bool *event, bool *terminate, bool *early, double *reached)
{
    (void)no_return;
    if (!engb_step(OF(c), duration)) {
        return fmi3Error;
    }
    *event = false;
    *terminate = false;
    *early = false;
    *reached = time + duration;
    return fmi3OK;
}

/* What modelDescription.xml says is not there; a caller's further arguments are never looked at. */
#define REFUSED(name) \
    ENGB_EXPORT fmi3Status name(fmi3Instance c) { (void)c; return fmi3Error; }
REFUSED(fmi3EnterEventMode)
REFUSED(fmi3GetBinary)
REFUSED(fmi3SetBinary)
REFUSED(fmi3GetClock)
REFUSED(fmi3SetClock)
REFUSED(fmi3GetNumberOfVariableDependencies)
REFUSED(fmi3GetVariableDependencies)
REFUSED(fmi3GetDirectionalDerivative)
REFUSED(fmi3GetAdjointDerivative)
REFUSED(fmi3EnterConfigurationMode)
REFUSED(fmi3ExitConfigurationMode)
REFUSED(fmi3GetIntervalDecimal)
REFUSED(fmi3GetIntervalFraction)
REFUSED(fmi3GetShiftDecimal)
REFUSED(fmi3GetShiftFraction)
REFUSED(fmi3SetIntervalDecimal)
REFUSED(fmi3SetIntervalFraction)
REFUSED(fmi3SetShiftDecimal)
REFUSED(fmi3SetShiftFraction)
REFUSED(fmi3EvaluateDiscreteStates)
REFUSED(fmi3UpdateDiscreteStates)
REFUSED(fmi3EnterContinuousTimeMode)
REFUSED(fmi3CompletedIntegratorStep)
REFUSED(fmi3SetTime)
REFUSED(fmi3SetContinuousStates)
REFUSED(fmi3GetContinuousStateDerivatives)
REFUSED(fmi3GetEventIndicators)
REFUSED(fmi3GetContinuousStates)
REFUSED(fmi3GetNominalsOfContinuousStates)
REFUSED(fmi3GetNumberOfEventIndicators)
REFUSED(fmi3GetNumberOfContinuousStates)
REFUSED(fmi3GetOutputDerivatives)
REFUSED(fmi3ActivateModelPartition)

/* Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0 */
/* What both versions of FMI share: one instance of the plant, and its variables by reference. */
#ifndef ENGB_FMU_INSTANCE_H
#define ENGB_FMU_INSTANCE_H

#include "engb_fmu.h"
#include "engb_model.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    engb_plant plant;
    double time;
    double effort;
    double disc_speed;
    double pad_temperature;
    double initial_position;
} engb_instance;

/* Set all to how the model file has it. */
static void engb_reset(engb_instance *instance)
{
    memset(instance, 0, sizeof *instance);
    instance->pad_temperature = 20.0;
    engb_plant_init(&instance->plant, 0.0);
}

/* Return where a variable stands, NULL where there is none of this reference. */
static double *engb_variable(engb_instance *instance, unsigned int reference)
{
    switch (reference) {
    case 0: return &instance->time;
    case 1: return &instance->effort;
    case 2: return &instance->disc_speed;
    case 3: return &instance->pad_temperature;
    case 4: return &instance->plant.sample[ENGB_POSITION];
    case 5: return &instance->plant.sample[ENGB_VELOCITY];
    case 6: return &instance->plant.sample[ENGB_ACCELERATION];
    case 7: return &instance->plant.sample[ENGB_LOAD];
    case 8: return &instance->initial_position;
    default: break;
    }
    if (reference - ENGB_FIRST_PARAMETER < ENGB_PARAMETERS) {
        return (double *)(void *)((char *)&instance->plant
                                  + engb_offsets[reference - ENGB_FIRST_PARAMETER]);
    }
    return NULL;
}

/* Copy variables out of the instance; return whether all were there. */
static int engb_get(engb_instance *instance, const unsigned int *references, size_t count,
                    double *values)
{
    size_t index;
    for (index = 0; index < count; ++index) {
        const double *place = engb_variable(instance, references[index]);
        if (place == NULL) {
            return 0;
        }
        values[index] = *place;
    }
    return 1;
}

/* Copy values into the instance; return whether all may be set: what it gives out may not. */
static int engb_set(engb_instance *instance, const unsigned int *references, size_t count,
                    const double *values)
{
    size_t index;
    for (index = 0; index < count; ++index) {
        double *place = engb_variable(instance, references[index]);
        if (place == NULL || references[index] == 0 ||
            (references[index] >= 4 && references[index] < 8)) {
            return 0;
        }
        *place = values[index];
    }
    return 1;
}

/* The start is over: the motor stands where it was told to. */
static void engb_begin(engb_instance *instance)
{
    instance->plant.sample[ENGB_POSITION] = instance->initial_position;
}

static void engb_step(engb_instance *instance, double duration)
{
    engb_plant_advance(&instance->plant, instance->effort, duration, instance->disc_speed,
                       instance->pad_temperature);
    instance->time += duration;
}

#endif

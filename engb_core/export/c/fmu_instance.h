/* Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0 */
/* What both versions of FMI share: one instance of the plant, its variables by reference, and its
 * state as a copy or as bytes. What may fail returns whether it did not. */
#ifndef ENGB_FMU_INSTANCE_H
#define ENGB_FMU_INSTANCE_H

#include "engb_fmu.h"
#include "engb_model.h"

#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define ENGB_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define ENGB_EXPORT __attribute__((visibility("default")))
#else
#define ENGB_EXPORT
#endif

typedef struct {
    engb_plant plant;
    double time;
    double effort;
    double disc_speed;
    double pad_temperature;
    double initial_position;
} engb_instance;

#define OF(component) ((engb_instance *)(component))

/* Set all to how the model file has it. */
static void engb_reset(engb_instance *instance)
{
    memset(instance, 0, sizeof *instance);
    instance->pad_temperature = 20.0;
    engb_plant_init(&instance->plant, 0.0);
}

/* Return a new instance; NULL where it is made for another unit, or there is no memory. */
static engb_instance *engb_make(const char *token)
{
    engb_instance *made = NULL;
    if (token != NULL && strcmp(token, ENGB_TOKEN) == 0) {
        made = (engb_instance *)malloc(sizeof *made);
    }
    if (made != NULL) {
        engb_reset(made);
    }
    return made;
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

/* Go on by a duration [s], which has to be above 0. */
static int engb_step(engb_instance *instance, double duration)
{
    if (!(duration > 0.0)) {
        return 0;
    }
    engb_plant_advance(&instance->plant, instance->effort, duration, instance->disc_speed,
                       instance->pad_temperature);
    instance->time += duration;
    return 1;
}

/* Copy an instance into a state, which is made where it is NULL. */
static int engb_keep(const void *instance, void **state)
{
    if (*state == NULL) {
        *state = malloc(sizeof(engb_instance));
    }
    if (*state == NULL) {
        return 0;
    }
    memcpy(*state, instance, sizeof(engb_instance));
    return 1;
}

static void engb_forget(void **state)
{
    free(*state);
    *state = NULL;
}

/* Copy a state into `size` bytes, and back into a state that is made. */
static int engb_write(const void *state, void *bytes, size_t size)
{
    if (size < sizeof(engb_instance)) {
        return 0;
    }
    memcpy(bytes, state, sizeof(engb_instance));
    return 1;
}

static int engb_read(const void *bytes, size_t size, void **state)
{
    if (size < sizeof(engb_instance)) {
        return 0;
    }
    *state = NULL;
    return engb_keep(bytes, state);
}

#endif

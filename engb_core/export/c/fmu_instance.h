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
    double reference;
    double acted_reference;
    double reference_velocity;
    double reference_effort;
    double closed_loop;
    double recorded_effort;
    double asked;       /* effort that the loop holds [N.m] */
    double until;       /* the loop's next cycle [s] */
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
    case 9: return &instance->reference;
    case 10: return &instance->acted_reference;
    case 11: return &instance->reference_velocity;
    case 12: return &instance->reference_effort;
    case 13: return &instance->closed_loop;
    case 14: return &instance->recorded_effort;
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

/* Return whether a variable is what the unit gives out, which may not be set. */
static int engb_given_out(unsigned int reference)
{
    return reference == 0 || (reference >= 4 && reference < 8) || reference == 10 ||
           reference == 14;
}

/* Copy values into the instance; return whether all may be set. */
static int engb_set(engb_instance *instance, const unsigned int *references, size_t count,
                    const double *values)
{
    size_t index;
    for (index = 0; index < count; ++index) {
        double *place = engb_variable(instance, references[index]);
        if (place == NULL || engb_given_out(references[index])) {
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
    instance->acted_reference = instance->reference;
}

/* Hold an effort [N.m] for a duration [s]. */
static void engb_hold(engb_instance *instance, double effort, double duration)
{
    engb_plant_advance(&instance->plant, effort, duration, instance->disc_speed,
                       instance->pad_temperature);
    instance->recorded_effort = engb_plant_recorded(&instance->plant, effort, duration);
}

/* Let the controller track the reference for a duration [s]: its cycles follow one another, however
 * long the steps are in which it is asked to go on. */
static void engb_track(engb_instance *instance, double duration)
{
    const double cycle = instance->plant.loop[ENGB_CYCLE];
    /* Steps are differences of times: what is left of their last digits is no step. */
    const double least = 1e-9 * (cycle < duration ? cycle : duration);
    double left = duration;
    while (left > least) {
        double part;
        if (instance->until <= least) {
            instance->asked = engb_plant_loop(&instance->plant, instance->reference,
                                              instance->reference_velocity,
                                              instance->reference_effort);
            instance->acted_reference = instance->reference -
                                        instance->plant.sample[ENGB_REFERENCE];
            instance->until = cycle;
        }
        part = instance->until;
        if (left < part - least) {
            part = left;
        }
        engb_hold(instance, instance->asked, part);
        left -= part;
        instance->until -= part;
    }
}

/* Go on by a duration [s], which has to be above 0. */
static int engb_step(engb_instance *instance, double duration)
{
    if (!(duration > 0.0)) {
        return 0;
    }
    if (instance->closed_loop > 0.5 && instance->plant.loop[ENGB_CYCLE] > 0.0) {
        engb_track(instance, duration);
    } else {
        instance->acted_reference = engb_plant_acted(&instance->plant, instance->reference,
                                                     duration);
        engb_hold(instance, instance->effort, duration);
    }
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

/* The vehicle with its actuators, sensors and air over one control period.
 *
 * Equipment is computed one lane after the other; the equations of motion advance all lanes at once. If the actuators
 * are ideal, the command is not delayed and no fault of an actuator or effector acts, the effectors follow the command
 * within the stops. Otherwise actuators and vehicle are advanced by the substeps of the actuators. */
#pragma once
#include "vehicle.h"

#ifdef BASE
#include "actuators.h"
#include "atmosphere.h"
#include "links.h"
#include "sensors.h"

/* Write the measurement (9) of the state x (9) in step k, as it arrives over the link. */
void hsv_sense(const hsv_plant *plant, hsv_plant_memory *memory, hsv_plant_faults *faults, int64_t k, const double *x,
               double *measurement)
{
    if (plant->sensors.ideal && faults->sensor.count == 0)
        for (int i = 0; i < STATES; i++)
            measurement[i] = memory->sensors[i].given = x[i]; /* a later drop-out repeats it */
    else
        hsv_measure(&plant->sensors, memory->sensors, &faults->sensor, k, plant->seed, x, measurement);
    hsv_receive(&plant->link, memory->link, memory->payloads, k, plant->seed, measurement, STATES);
}

/* Write the conditions of air and engine for the period after step k to the memory of the plant. */
void hsv_plant_conditions(const hsv_plant *plant, hsv_plant_memory *memory, hsv_plant_faults *faults, int64_t k,
                          const double *x, double fuel)
{
    double *conditions = memory->conditions;
    if (!plant->atmosphere.still)
        hsv_atmosphere_step(&plant->atmosphere, memory->atmosphere, k, plant->seed, x[ALTITUDE], x[VELOCITY],
                            conditions);
    double alpha = x[ALPHA], mach = 0.0;
    if (faults->engine.count > 0) {
        const AirRelative air =
            air_relative(x[VELOCITY], x[PITCH] - alpha, conditions[WIND_FORWARD], conditions[WIND_UP]);
        alpha -= air.turn;
        mach = air.speed / speed_of_sound(x[ALTITUDE], (const Vehicle *)&plant->vehicle);
    }
    hsv_apply_engine_faults(&faults->engine, k, plant->seed, alpha, mach, fuel, conditions + THRUST_FACTOR);
}
#endif

/* Return whether the air is still and the engine has no scheduled faults, so that the conditions are constant. */
static inline int is_calm(const hsv_plant *plant, const hsv_plant_faults *faults)
{
    return plant->atmosphere.still && faults->engine.count == 0;
}

/* Return whether a plant has equipment or faults that must be computed lane by lane. */
static inline int is_equipped(const hsv_plant *plant, const hsv_plant_faults *faults)
{
    const int ideal = plant->actuators.ideal && plant->sensors.ideal && plant->link.ideal && plant->late == 0.0;
    return !ideal || !is_calm(plant, faults) || faults->effector.count > 0 || faults->sensor.count > 0;
}

/* Copy the constants of a vehicle into lane i. */
static inline void gather_vehicle(const hsv_vehicle *p, int i, Vehicle *vehicle)
{
    for (size_t j = 0; j < sizeof *vehicle / sizeof(plain); j++)
        lane(((plain *)vehicle)[j], i) = ((const double *)p)[j];
}

/* Copy "count" numbers from lane i. */
static inline void read_lane(const real *from, int count, int i, double *to)
{
    for (int j = 0; j < count; j++) to[j] = lane(from[j], i);
}

/* Copy "count" numbers to lane i. */
static inline void write_lane(const double *from, int count, int i, real *to)
{
    for (int j = 0; j < count; j++) lane(to[j], i) = from[j];
}

/* Advance the effectors of the flights marked in "moving", then all vehicles, by "length" substeps. */
static inline void advance_moving(hsv_flight *const *flights, const Vehicle *vehicle, const int *moving, int64_t k,
                                  double substep, double length, const real *command, const real *conditions, real *x)
{
    real effector[INPUTS] = {all(0.0), all(0.0)};
    for (int i = 0; i < LANES; i++)
        if (moving[i]) {
            hsv_plant_memory *memory = flights[i]->plant_memory;
            double own[INPUTS];
            read_lane(command, INPUTS, i, own);
            hsv_move_effectors(&flights[i]->plant->actuators, memory->actuators, &flights[i]->plant_faults->effector, k,
                               substep, length, own, lane(x[ALPHA], i), memory->effector);
            write_lane(memory->effector, INPUTS, i, effector);
        }
    advance(x, effector, vehicle, conditions, all(length * flights[0]->plant->actuators.substep), 1);
}

/* Advance the states x by the period after step k, with "actuator", the input of the actuators, held. */
static inline void advance_plants(hsv_flight *const *flights, const Vehicle *vehicle, int64_t k, const real *actuator,
                                  real *x)
{
    const hsv_plant *first = flights[0]->plant;
    const double late = first->late;
    real held[CONDITIONS], before[INPUTS], effector[INPUTS], passed[STATES];
    const int calm = is_calm(first, flights[0]->plant_faults);
    int moving[LANES], number = 0;
    for (int i = 0; i < LANES; i++) {
        hsv_plant_memory *memory = flights[i]->plant_memory;
        if (!calm) {
            double own[STATES];
            read_lane(x, STATES, i, own);
            hsv_plant_conditions(flights[i]->plant, memory, flights[i]->plant_faults, k, own, lane(actuator[FUEL], i));
            write_lane(memory->conditions, CONDITIONS, i, held);
        }
        const int64_t acting = hsv_begin_faults(&flights[i]->plant_faults->effector, k, flights[i]->plant->seed);
        number += moving[i] = acting > 0 || !first->actuators.ideal || late != 0.0;
        write_lane(memory->command, INPUTS, i, before);
    }
    const real *conditions = calm ? NULL : held;
    memcpy(passed, x, sizeof passed);
    if (number < LANES) {
        for (int j = 0; j < INPUTS; j++)
            effector[j] = limited(actuator[j], first->actuators.minimum[j], first->actuators.maximum[j]);
        advance(passed, effector, vehicle, conditions, all(first->period), first->substeps);
    }
    if (number > 0)
        for (int j = 0; j < ACTUATOR_SUBSTEPS; j++) {
            /* Share of the substep during which the previous command still acts. */
            const double share = late - j < 0.0 ? 0.0 : late - j > 1.0 ? 1.0 : late - j;
            if (share > 0.0) advance_moving(flights, vehicle, moving, k, j, share, before, conditions, x);
            if (share < 1.0)
                advance_moving(flights, vehicle, moving, k, j + share, 1.0 - share, actuator, conditions, x);
        }
    for (int i = 0; i < LANES; i++) {
        hsv_plant_memory *memory = flights[i]->plant_memory;
        read_lane(actuator, INPUTS, i, memory->command);
        if (moving[i]) continue;
        read_lane(effector, INPUTS, i, memory->effector);
        for (int j = 0; j < INPUTS; j++)
            memory->actuators[2 * j] = memory->effector[j], memory->actuators[2 * j + 1] = 0.0;
        for (int j = 0; j < STATES; j++) lane(x[j], i) = lane(passed[j], i);
    }
}

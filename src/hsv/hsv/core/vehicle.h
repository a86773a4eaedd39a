/* Equations of motion of a vehicle (paper eq. 1 and eq. 4) and their integration over a control period.
 *
 *   dh/dt     = V sin(theta - alpha)
 *   dV/dt     = (T cos alpha - D) / m - g sin(theta - alpha)
 *   dalpha/dt = (-T sin alpha - L) / (m V) + q + g / V cos(theta - alpha)
 *   dtheta/dt = q
 *   dq/dt     = (M + psi_1 eta_1'' + psi_2 eta_2'') / I_yy
 *   k_i eta_i'' = -2 zeta_i omega_i eta_i' - omega_i^2 eta_i + N_i - psi_i M / I_yy - psi_1 psi_2 eta_j'' / I_yy
 *
 * with k_i = 1 + psi_i^2 / I_yy and j the other mode (eq. 1). Without inertial coupling, psi_1 = psi_2 = 0, this is the
 * decoupled model (eq. 4). Lift L, drag D, thrust T and moment M depend on the structure of the vehicle: parker.h or
 * winged_cone.h. On the round earth of the latter, V^2 / r is subtracted from g in dalpha/dt. N_1 and N_2, the
 * generalised forces, are quadratic in alpha, N_2 also affine in delta_e; a rigid vehicle has N_i = psi_i = 0.
 *
 * State x: altitude h (m), velocity V (m/s), angle of attack alpha (rad), pitch angle theta (rad), pitch rate q
 * (rad/s), eta_1 (kg^0.5 m) and its rate, eta_2 and its rate. Input u: equivalence ratio phi (1), elevator delta_e
 * (rad). V and alpha are inertial, that is relative to still air; wind acts through the conditions, see forces_in. */
#pragma once
#include "elementary.h"

/* Conditions of air and engine: wind forward and up (m/s), density relative to the model, factors of thrust, lift and
 * drag, increment of the pitching-moment coefficient. */
enum { WIND_FORWARD, WIND_UP, DENSITY, THRUST_FACTOR, LIFT_FACTOR, DRAG_FACTOR, MOMENT_INCREMENT };

typedef struct {
#define number plain
#include "vehicle_fields.h"
#undef number
} Vehicle;

typedef struct {
    real lift, drag, thrust, moment, pressure; /* N, N, N, N m, Pa */
} Forces;

/* The structures of vehicles; each has a header with its equations. A new one needs a number here, a case in the
 * functions below and an entry in hsv.model.dynamics.STRUCTURES. */
enum { PARKER, WINGED_CONE };
#include "parker.h"
#include "winged_cone.h"

/* Return the structure, which all flights of a group of lanes have in common; PARKER for an unknown number. */
static inline int structure(const Vehicle *p)
{
    const double number = lane(p->structure, 0);
    return number > 0.0 && number < 100.0 ? (int)number : PARKER;
}

/* Return the forces at an altitude (m), a speed (m/s) and an angle of attack (rad) relative to still air, a pitch rate
 * (rad/s) and the inputs. */
static inline Forces forces(real altitude, real velocity, real alpha, real rate, const real *u, const Vehicle *p)
{
    switch (structure(p)) {
    case WINGED_CONE: return winged_cone_forces(altitude, velocity, alpha, rate, u, p);
    default: return parker_forces(altitude, velocity, alpha, u, p);
    }
}

/* Return the acceleration of gravity (m/s^2); write its relief V^2 / r (m/s^2) on a round planet, else 0. */
static inline real gravity(real altitude, real velocity, const Vehicle *p, real *relief)
{
    if (structure(p) == WINGED_CONE) return winged_cone_gravity(altitude, velocity, p, relief);
    *relief = all(0.0);
    return p->gravity;
}

#ifndef COMPLEX
/* Return the speed of sound (m/s) at a geometric altitude (m). If the equations of the structure do not contain it, it
 * is that of the US Standard Atmosphere 1976, valid up to a geopotential altitude of 47 km. */
static inline real speed_of_sound(real altitude, const Vehicle *p)
{
    if (structure(p) == WINGED_CONE) return winged_cone_sound(altitude, p);
    const real geopotential = 6356766.0 * altitude / (6356766.0 + altitude);
    const real temperature = 216.65 + 0.0065 * maximum(11000.0 - geopotential, all(0.0)) +
                             0.001 * maximum(geopotential - 20000.0, all(0.0)) +
                             0.0018 * maximum(geopotential - 32000.0, all(0.0));
    return root(1.4 * 287.05287 * temperature);
}

typedef struct {
    real speed, turn, sine, cosine; /* V_a (m/s); gamma_a - gamma (rad), its sine and cosine */
} AirRelative;

/* Return speed V_a and path angle gamma_a relative to the air, for a wind (forward, up; m/s) and the inertial path
 * angle gamma = theta - alpha (rad). */
static inline AirRelative air_relative(real velocity, real path_angle, real forward, real up)
{
    real sine, cosine;
    sine_cosine(path_angle, &sine, &cosine);
    const real along = velocity - (forward * cosine + up * sine), across = forward * sine - up * cosine;
    AirRelative air;
    air.speed = root(along * along + across * across);
    air.turn = arctangent2(across, along);
    air.sine = across / air.speed;
    air.cosine = along / air.speed;
    return air;
}

/* Return the forces under the conditions of air and engine, and write the angle of attack relative to the air (rad).
 * Lift and drag are rotated from the air-relative to the inertial path: they are returned perpendicular and parallel to
 * the inertial velocity. */
static inline Forces forces_in(const real *conditions, const real *x, const real *u, const Vehicle *p, real *alpha)
{
    const AirRelative air =
        air_relative(x[VELOCITY], x[PITCH] - x[ALPHA], conditions[WIND_FORWARD], conditions[WIND_UP]);
    *alpha = x[ALPHA] - air.turn;
    Forces f = forces(x[ALTITUDE], air.speed, *alpha, x[PITCH_RATE], u, p);
    const real moment = conditions[DENSITY] *
                        (f.moment - p->thrust_moment_arm * f.thrust +
                         f.pressure * p->reference_area * p->mean_aerodynamic_chord * conditions[MOMENT_INCREMENT]);
    f.thrust *= conditions[THRUST_FACTOR];
    if (structure(p) != PARKER) f.thrust *= conditions[DENSITY]; /* Parker's thrust does not depend on density */
    const real lift = f.lift * (conditions[DENSITY] * conditions[LIFT_FACTOR]);
    const real drag = f.drag * (conditions[DENSITY] * conditions[DRAG_FACTOR]);
    f.lift = lift * air.cosine - drag * air.sine;
    f.drag = drag * air.cosine + lift * air.sine;
    f.moment = moment + p->thrust_moment_arm * f.thrust;
    f.pressure = conditions[DENSITY] * f.pressure;
    return f;
}
#endif

/* Write dx/dt (9) under the conditions of air and engine; NULL: still air and a healthy engine. */
static inline void derivative(const real *x, const real *u, const Vehicle *p, const real *conditions, real *out)
{
    const real velocity = x[VELOCITY], elevator = u[ELEVATOR];
    real alpha = x[ALPHA], relief;
#ifdef COMPLEX
    (void)conditions;
    const Forces f = forces(x[ALTITUDE], velocity, alpha, x[PITCH_RATE], u, p);
#else
    const Forces f =
        conditions ? forces_in(conditions, x, u, p, &alpha) : forces(x[ALTITUDE], velocity, alpha, x[PITCH_RATE], u, p);
#endif
    const real alpha2 = alpha * alpha;
    const real force_1 =
        p->elastic_force_1_alpha_squared * alpha2 + p->elastic_force_1_alpha * alpha + p->elastic_force_1_zero;
    const real force_2 = p->elastic_force_2_alpha_squared * alpha2 + p->elastic_force_2_alpha * alpha +
                         p->elastic_force_2_elevator * elevator + p->elastic_force_2_zero;
    const plain psi_1 = p->inertial_coupling_1, psi_2 = p->inertial_coupling_2;
    const plain omega_1 = p->natural_frequency_1, omega_2 = p->natural_frequency_2;
    /* Solve the 2x2 system of the elastic accelerations; c_1, c_2 and "angular" contain 1 / I_yy. */
    const plain c_1 = psi_1 / p->moment_of_inertia, c_2 = psi_2 / p->moment_of_inertia;
    const real angular = f.moment / p->moment_of_inertia;
    const plain k_1 = 1.0 + psi_1 * c_1, k_2 = 1.0 + psi_2 * c_2, k_12 = psi_1 * c_2;
    const real right_1 =
        -2.0 * p->damping_ratio_1 * omega_1 * x[ETA_1_RATE] - omega_1 * omega_1 * x[ETA_1] + force_1 - psi_1 * angular;
    const real right_2 =
        -2.0 * p->damping_ratio_2 * omega_2 * x[ETA_2_RATE] - omega_2 * omega_2 * x[ETA_2] + force_2 - psi_2 * angular;
    const plain determinant = k_1 * k_2 - k_12 * k_12;
    const real acceleration_1 = (k_2 * right_1 - k_12 * right_2) / determinant;
    const real acceleration_2 = (k_1 * right_2 - k_12 * right_1) / determinant;

    real sin_alpha, cos_alpha, sin_path, cos_path;
    sine_cosine(x[ALPHA], &sin_alpha, &cos_alpha);
    sine_cosine(x[PITCH] - x[ALPHA], &sin_path, &cos_path);
    out[ALTITUDE] = velocity * sin_path;
    const real weight = gravity(x[ALTITUDE], velocity, p, &relief);
    out[VELOCITY] = (f.thrust * cos_alpha - f.drag) / p->mass - weight * sin_path;
    out[ALPHA] = (-f.thrust * sin_alpha - f.lift) / (p->mass * velocity) + x[PITCH_RATE] +
                 (weight - relief) / velocity * cos_path;
    out[PITCH] = x[PITCH_RATE];
    out[PITCH_RATE] = angular + c_1 * acceleration_1 + c_2 * acceleration_2;
    out[ETA_1] = x[ETA_1_RATE];
    out[ETA_1_RATE] = acceleration_1;
    out[ETA_2] = x[ETA_2_RATE];
    out[ETA_2_RATE] = acceleration_2;
}

/* Advance x by one period (s) with u and the conditions held, by classical Runge-Kutta steps of fourth order. */
static inline void advance(real *x, const real *u, const Vehicle *p, const real *conditions, real period,
                           int64_t substeps)
{
    const real h = period / (double)substeps;
    real slope[STATES], point[STATES], total[STATES];
    for (int64_t step = 0; step < substeps; step++) {
        for (int i = 0; i < STATES; i++) point[i] = total[i] = x[i];
        for (int stage = 0; stage < 4; stage++) {
            const real reach = stage == 2 ? h : 0.5 * h;
            derivative(point, u, p, conditions, slope);
            for (int i = 0; i < STATES; i++) {
                total[i] = stage == 0 ? slope[i] : total[i] + (stage < 3 ? 2.0 * slope[i] : slope[i]);
                point[i] = x[i] + reach * slope[i];
            }
        }
        for (int i = 0; i < STATES; i++) x[i] += h / 6.0 * total[i];
    }
}

#ifndef COMPLEX
/* Return whether the state is finite, its velocity positive, and its angles are within the limit (rad). */
static inline mask in_model_range(const real *x, double angle_limit)
{
    mask inside = x[VELOCITY] > 0.0;
    inside &= magnitude(x[ALPHA]) <= angle_limit;
    inside &= magnitude(x[PITCH]) <= angle_limit;
    for (int i = 0; i < STATES; i++) inside &= is_finite(x[i]);
    return inside;
}
#endif

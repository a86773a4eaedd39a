/* The core for one flight: the loop, steps of its single blocks, and all other functions of core.h. */
#define BASE
#define NAME single
#include "instance.h"
#include "sequences.h"
#include "trim.h"

_Static_assert(sizeof(TubeMemory) == 10 * sizeof(double), "one layout of the tube law's memory");

static const Vehicle *vehicle_of(const hsv_vehicle *p) { return (const Vehicle *)p; }

void hsv_sine_cosine(double x, double *sine, double *cosine) { sine_cosine(x, sine, cosine); }
double hsv_exponential(double x) { return exponential(x); }
void hsv_derivative(const double *x, const double *u, const hsv_vehicle *p, const double *conditions, double *out)
{
    derivative(x, u, vehicle_of(p), conditions, out);
}

void hsv_forces(const double *x, const double *u, const hsv_vehicle *p, const double *conditions, double *out)
{
    double alpha = x[ALPHA];
    const Forces f = conditions ? forces_in(conditions, x, u, vehicle_of(p), &alpha)
                                : forces(x[ALTITUDE], x[VELOCITY], alpha, x[PITCH_RATE], u, vehicle_of(p));
    out[0] = f.lift, out[1] = f.drag, out[2] = f.thrust, out[3] = f.moment, out[4] = f.pressure, out[5] = alpha;
}

void hsv_advance(double *x, const double *u, const hsv_vehicle *p, const double *conditions, double period,
                 int64_t substeps)
{
    advance(x, u, vehicle_of(p), conditions, period, substeps);
}

int hsv_in_model_range(const double *x, double angle_limit) { return in_model_range(x, angle_limit); }
double hsv_speed_of_sound(double altitude, const hsv_vehicle *p) { return speed_of_sound(altitude, vehicle_of(p)); }
void hsv_advance_plant(const hsv_plant *plant, hsv_plant_memory *memory, hsv_plant_faults *faults, int64_t k,
                       const double *actuator, double *x)
{
    hsv_flight flight = {.plant = plant, .plant_memory = memory, .plant_faults = faults};
    hsv_flight *const flights[] = {&flight};
    advance_plants(flights, vehicle_of(&plant->vehicle), k, actuator, x);
}

void hsv_notch_rest(const hsv_notch *notch, double rate, double *s) { notch_rest(notch, rate, s); }
double hsv_notch_step(const hsv_notch *notch, double *s, double rate) { return notch_step(notch, s, rate); }

void hsv_estimate(const hsv_estimator *estimator, double *memory, int64_t k, const double *measurement,
                  const double *command, double *estimate)
{
    estimate_step(estimator, vehicle_of(&estimator->vehicle), memory, k, measurement, command, estimate);
}

int hsv_nominal_input(const hsv_nominal *nominal, const double *x_n, double *u_n, double *index)
{
    return nominal_input(nominal, x_n, u_n, index);
}

int hsv_nominal_advance(const hsv_polytope *polytope, double altitude, double velocity, double *x_n, const double *u_n,
                        const double *d_r)
{
    return nominal_advance(polytope, altitude, velocity, x_n, u_n, d_r);
}

int64_t hsv_tube_step(const hsv_tube *tube, hsv_tube_memory *memory, int64_t k, int monitored, int64_t filter_states,
                      const double *x, double q_f, const double *x_r, const double *u_r, const double *x_n,
                      const double *u_n, const double *s, double *u_feedback, double *u_unsaturated, double *u)
{
    const double effectiveness = tube->effectiveness ? hsv_effectiveness_step(tube->effectiveness, memory, k, x) : 1.0;
    const int64_t active = active_gain(tube, k);
    tube_step(tube, (TubeMemory *)memory, tube->gains + INPUTS * STATES * active, effectiveness, k, monitored,
              filter_states, x, q_f, x_r, u_r, x_n, u_n, s, u_feedback, u_unsaturated, u);
    memcpy(memory->held, u, sizeof memory->held);
    return active;
}

double hsv_effectiveness_step(const hsv_effectiveness *effectiveness, hsv_tube_memory *memory, int64_t k,
                              const double *x)
{
    return effectiveness_step(effectiveness, vehicle_of(&effectiveness->vehicle), memory->predicted, memory->held,
                              memory->known, k, x);
}

void hsv_air_relative(double velocity, double path_angle, double forward, double up, double *out)
{
    const AirRelative air = air_relative(velocity, path_angle, forward, up);
    out[0] = air.speed, out[1] = air.turn, out[2] = air.sine, out[3] = air.cosine;
}

void hsv_effectiveness_bounds(const hsv_effectiveness *effectiveness, const double *step, double *bounds)
{
    Interval loss, offset;
    step_intervals(effectiveness, step[0], step[1], step[2], step[3], step[4], &loss, &offset);
    bounds[0] = loss.low, bounds[1] = loss.high, bounds[2] = offset.low, bounds[3] = offset.high;
}

int32_t hsv_call_step(const hsv_call *call, int64_t k, const double *in, double *out)
{
    return call_step(call, k, in, out, INPUTS);
}

void hsv_set_guards(double *behind) { set_guards(behind); }
int hsv_intact(const double *behind) { return intact(behind); }

double hsv_level(const double *P, int64_t size, const double *x) { return level(P, size, x); }

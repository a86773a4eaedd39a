/* Interface of the numeric core. cffi reads the text between the marks "begin" and "end", so that each struct is
 * declared only once. hsv.core fills structs by the names of their fields. The comment after a pointer gives the shape
 * of its array and says whether it is optional (NULL); hsv.core checks the shape and sets the fields that count
 * elements. Units are SI. */
#pragma once
#include <stdint.h>
/* begin */
typedef double number;
/* Numbers of states, inputs, rigid-body states (the first of the states), and conditions of air and engine; maximum
 * number of sections of the notch filter, and of steps of a delay, latency or jitter; number of states with integral
 * action; substeps of a period for actuators that are not ideal. */
enum { STATES = 9, INPUTS = 2, RIGID = 5, CONDITIONS = 7, MAX_SECTIONS = 4, MAX_DELAY = 50, INTEGRATED = 2 };
enum { ACTUATOR_SUBSTEPS = 4 };
/* Magnitude (SI) above which the receiver of a link regards a number as corrupted. */
enum { LARGEST = 1000000 };
/* Limit on the numbers of steps in a fault. */
enum { MOST_STEPS = 2147483647 };
/* Guard words behind arrays that foreign code writes to, and the result of a step function that overwrote them. */
enum { GUARDS = 8, OVERRUN = -2147483647 };
/* Largest x' P x of a state inside an ellipsoid: 1 with a tolerance, because by design the first deviation lies on the
 * boundary of the outermost ellipsoid. */
static const double MEMBERSHIP_BOUNDARY = 1.0 + 1e-6;
/* Columns of the history and of the auxiliary history, see hsv.flight.history; entries of a model summed at a time. */
enum { HISTORY = 25, AUXILIARY = 3, SUMS = 12 };
enum { ACTED = 21 };         /* first column of the history that the second half of a step writes */
enum { SENSE = 1, ACT = 2 }; /* halves of a step, see loop.h */
enum { ALTITUDE, VELOCITY, ALPHA, PITCH, PITCH_RATE, ETA_1, ETA_1_RATE, ETA_2, ETA_2_RATE };
enum { FUEL, ELEVATOR };

/* clang-format off */
/* Kinds of faults: of the command, an actuator, an effector, the engine and a sensor. hsv.model.faults.table has the
 * same numbers, and the order of composition. Never change a number: random numbers of a flight depend on it. */
enum hsv_fault_kind {
    LOSS = 0, REVERSAL = 1, DELAY = 2, DEAD_ZONE = 3, BACKLASH = 4,
    BANDWIDTH = 5, RATE_LIMIT = 6, STOP_LIMIT = 7,
    SCALE = 8, BIAS = 9, DRIFT = 10, OSCILLATION = 11,
    LOCK = 12, LOCK_AT = 13, FLOAT = 14, HARD_OVER = 15, SOLID_OSCILLATION = 16,
    THRUST_LOSS = 17, UNSTART = 18, UNSTART_OUTSIDE = 19,
    SENSOR_SCALE = 20, SENSOR_NOISE = 21, SENSOR_BIAS = 22, SENSOR_RUNAWAY = 23, SENSOR_DROP_OUT = 24,
    SENSOR_FREEZE = 25
};
enum { ALWAYS, PERIODIC, RANDOM }; /* occurrence of a fault, see faults.h */
enum { SSE2, AVX2, AVX512 }; /* instruction sets; on other processors than x86-64 the first is the only one */

/* First of the 256 random streams of each block. Never change a number: random numbers of a flight depend on it. */
enum {
    TURBULENCE_FORWARD = 256, TURBULENCE_UP = 512, DENSITY_VARIATION = 768,
    SENSOR_NOISE_STREAM = 4096, SENSOR_CONSTANTS = 4352, SENSOR_LOSS = 4608,
    SENSOR_FAULT_NOISE = 4864, SENSOR_FAULT_LOSS = 5120, FAULT_OCCURRENCE = 8192,
    LINK_LOSS = 12288, LINK_DELAY = 12544, LINK_CORRUPTION = 12800
};
/* clang-format on */

typedef struct {
#include "vehicle_fields.h"
} hsv_vehicle;

/* Notch filter: second-order sections in series, see notch_filter.h. */
typedef struct {
    const double *A; /* (sections <= 4, 2, 2) */
    const double *B; /* (sections, 2) */
    const double *C; /* (sections, 2) */
    const double *D; /* (sections) */
    const double *G; /* (sections, 2) states in equilibrium for unit input */
    int64_t sections;
} hsv_notch;

/* Weights of the vertices along a scheduling variable: a cubic polynomial per piece, highest power first. */
typedef struct {
    const double *coefficients; /* (4, pieces, vertices) */
    const double *breakpoints;  /* (pieces + 1) */
    int64_t pieces, vertices;
} hsv_axis;

/* Polytopic model: the entries of [A_i, B_i] that are non-zero in at least one vertex, and their indices. */
typedef struct {
    const double *S;        /* (vertices <= 64, size <= 108) */
    const int64_t *entries; /* (used <= 99) indices in the flattened [A_i, B_i] */
    const int64_t *starts;  /* (19) index in entries at which each row of A and of B begins, alternately */
    int64_t vertices, size, used;
    hsv_axis altitude, velocity;
} hsv_polytope;

/* Nominal law: nested gains and ellipsoids, outermost first, see nominal.h. */
typedef struct {
    hsv_polytope polytope;
    const double *gains;      /* (count, 2, 9) */
    const double *ellipsoids; /* (count, 5, 5) */
    int64_t count, interpolated;
} hsv_nominal;

/* Reference x_r, u_r, d_r, a row for each step; row 0 belongs to step "first". */
typedef struct {
    const double *state;  /* (rows, 9) */
    const double *input;  /* (rows, 2) */
    const double *defect; /* (rows, 9) */
    int64_t first, rows;
} hsv_reference;

/* Estimator of the elevator effectiveness, see effectiveness.h. start: initial state; inertia, effect: bounds of the
 * relative errors i and g; least: smallest P; bound, noise: bound of |v| relative to |e|, and in rad/s; offset: bound
 * of |d| relative to |e|; learning: share of a new d in a step; drift: change of P per step; steps: number of steps
 * that confirm a first fault. */
typedef struct {
    hsv_vehicle vehicle;
    double start[9];
    double period, inertia, effect, least, bound, offset, learning, drift, noise, steps;
} hsv_effectiveness;

/* Tube law, see tube_law.h. planned: whether the law uses the nominal state; filtered: whether it filters the planned
 * pitch rate; minimum, maximum: input limits; integral_rate: k (1/s) of the integral action, 0 for none. */
typedef struct {
    const double *gains;   /* (count, 2, 9) F diag(tau) */
    const int64_t *starts; /* (count) first step of each gain */
    int64_t count, planned, filtered;
    double minimum[2], maximum[2], integral_rate, period;
    hsv_notch notch;
    const hsv_effectiveness *effectiveness; /* NULL: effectiveness is not estimated */
} hsv_tube;

/* Estimates of the effectiveness estimator: P by which the command is divided, interval of P, interval of the offset
 * (rad/s), disturbance d (rad/s) if g = 0, effect e (rad/s) in the last healthy step, mode, number of steps that the
 * hypotheses explain. */
enum { EFFECTIVENESS, LOW, HIGH, OFFSET_LOW, OFFSET_HIGH, DISTURBANCE, EFFECT, MODE, COUNT, KNOWN };

typedef struct {
    double planned[8], integral[2]; /* state s_n of the notch filter of the plan; integral of the error */
    double predicted[9], held[2];   /* effectiveness estimator: state of the previous step, input held since then */
    double known[KNOWN];            /* effectiveness estimator: its estimates */
} hsv_tube_memory;

/* State estimator: extended Kalman filter with constant gain, see estimator.h. */
typedef struct {
    double gain[11][5], start[9], period;
    hsv_vehicle vehicle;
    int64_t substeps;
} hsv_estimator;

typedef struct {
    int64_t order[2];
    double natural_frequency[2], damping_ratio[2], map[2][4];
    double minimum[2], maximum[2], rate_limit[2], acceleration_limit[2];
    double substep;
    int64_t ideal;
} hsv_actuators;

typedef struct {
    double wind[2], shear, shear_altitude, sigma[2], length[2];
    const int64_t *gust_start; /* (gusts) */
    const double *gust;        /* (gusts, 2) forward, up */
    const double *gust_length; /* (gusts) */
    const double *gust_stays;  /* (gusts) */
    double density_offset, density_sigma, density_length, period;
    int64_t still, gusts;
} hsv_atmosphere;

typedef struct {
    int64_t on[9];
    double noise[9], bias[9], bias_sigma[9], drift_sigma[9], drift_decay[9], walk[9], scale[9], scale_sigma[9];
    double lag_decay[9];
    int64_t latency[9];
    double drop_out[9], quantum[9], minimum[9], maximum[9];
    int64_t inertial_angle_of_attack, ideal;
} hsv_sensors;

typedef struct {
    double lagged, drift, walk, bias, scale, held, given;
    double queue[MAX_DELAY + 1]; /* samples that wait for the latency */
} hsv_sensor_memory;

/* Memory of a link: step in which the last accepted payload was sent, whether the previous payload was lost, whether a
 * payload was ever sent; then the last accepted payload, and the payloads that may still arrive. */
enum { NEWEST, LOSING, BEGUN, ACCEPTED };

typedef struct {
    int64_t channel, delay, jitter;
    double loss, loss_after_arrival, loss_after_loss, corruption;
    int64_t checksum, ideal;
} hsv_link;

/* A fault, and its memory, see faults.h. */
typedef struct {
    double start, stop; /* steps [start, stop) */
    int64_t channel, code, occurrence;
    double cycle[2]; /* period and duration (steps), or probability per step that it disappears and that it returns */
    double parameter[12];
} hsv_fault;

typedef struct {
    int64_t acting, away;
    double last, onset, since, kept; /* last and first step in action, step of unstart, kept value of the signal */
    double queue[MAX_DELAY + 1];
} hsv_fault_memory;

typedef struct {
    const hsv_fault *rows;    /* (count) in the order of composition */
    hsv_fault_memory *memory; /* (count) */
    int64_t count;
    double period;
} hsv_faults;

typedef struct {
    hsv_vehicle vehicle;
    double period;
    int64_t substeps;
    hsv_actuators actuators;
    hsv_atmosphere atmosphere;
    hsv_sensors sensors;
    hsv_link link;
    double late; /* time from the start of a period to its command, in substeps */
    int64_t seed;
} hsv_plant;

typedef struct {
    double *actuators;          /* (2, 2) position and rate */
    double *command;            /* (2) command of the previous period */
    double *effector;           /* (2) */
    double *atmosphere;         /* (air) */
    hsv_sensor_memory *sensors; /* (9) */
    double *link;               /* (payloads) */
    double *conditions;         /* (7) */
    int64_t air, payloads;
} hsv_plant_memory;

typedef struct {
    hsv_faults effector, engine, sensor;
} hsv_plant_faults;

/* A step function of hsv_block.h with its arrays. */
typedef int32_t (*hsv_step_function)(int64_t k, const double *in, double *out, double *state, const double *par);
typedef struct {
    hsv_step_function function; /* NULL: the law of the core is used */
    double *state;              /* or NULL */
    const double *par;          /* or NULL */
} hsv_call;

/* Invariant set of the tube: (e - c)' P (e - c) <= 1 for the errors e of the rigid states and of the notch filter. */
typedef struct {
    hsv_notch notch;
    const double *shape;  /* (size, size) P */
    const double *centre; /* (size) c */
    int64_t size;
} hsv_tube_set;

/* Sampled actuators with the states a and commands c: a(k+1) = A a + B c, mean position over a period C a + D c. */
typedef struct {
    const double *A; /* (states <= 4, states) */
    const double *B; /* (states, 2) */
    const double *C; /* (2, states) */
    const double *D; /* (2, 2) */
    int64_t states;
} hsv_sampled;

/* A flight: its blocks, their memory, and its history. */
typedef struct {
    double x[9]; /* initial state */
    const hsv_plant *plant;
    hsv_plant_memory *plant_memory;
    hsv_plant_faults *plant_faults;
    const hsv_notch *notch;
    const hsv_estimator *estimator; /* NULL: no estimator */
    const hsv_nominal *nominal;
    const hsv_reference *reference;
    const hsv_tube *tube;
    const hsv_link *link;
    double *link_memory; /* (payloads) */
    int64_t payloads;
    hsv_faults *faults; /* of the command */
    hsv_call nominal_law, controller;
    const double *commanded; /* (2) external input before the limits, or NULL; in a group all or none have it */
    const hsv_tube_set *set; /* NULL: the level (e - c)' P (e - c) is not computed */
    double *history;         /* (rows, 25) */
    double *auxiliary;       /* (rows, 3) */
    double *estimated;       /* (rows, 9), or NULL */
    int64_t rows;            /* rows of the histories; the first is for the first step of a call */
    int64_t ended;           /* output: number of steps flown if the flight diverges */
    int64_t returned;        /* output: return value of the controller */
    double answer[2];        /* output: input returned by the controller */
    double worst;            /* output: largest level of the flight */
} hsv_flight;

/* A call of a step function with two outputs, which returns its result or OVERRUN; guard words behind its state. */
int32_t hsv_call_step(const hsv_call *call, int64_t k, const double *in, double *out);
void hsv_set_guards(double *behind);
int hsv_intact(const double *behind);
/* Elementary functions and random numbers. */
void hsv_sine_cosine(double x, double *sine, double *cosine);
double hsv_tangent(double x);
double hsv_arcsine(double x);
double hsv_arctangent2(double y, double x);
double hsv_exponential(double x);
double hsv_logarithm(double x);
void hsv_philox(const uint64_t *counter, const uint64_t *key, uint64_t *words);
void hsv_uniforms(int64_t seed, int64_t step, int64_t stream, int64_t draw, double *pair);
void hsv_normals(int64_t seed, int64_t step, int64_t stream, int64_t draw, double *pair);
/* Vehicle; conditions may be NULL. Forces: lift, drag, thrust, moment, dynamic pressure, air-relative alpha. */
void hsv_derivative(const double *x, const double *u, const hsv_vehicle *p, const double *conditions, double *out);
void hsv_complex_derivative(const double *x, const double *u, const hsv_vehicle *p, double *out);
void hsv_forces(const double *x, const double *u, const hsv_vehicle *p, const double *conditions, double *out);
void hsv_advance(double *x, const double *u, const hsv_vehicle *p, const double *conditions, double period,
                 int64_t substeps);
int hsv_in_model_range(const double *x, double angle_limit);
double hsv_speed_of_sound(double altitude, const hsv_vehicle *p);
void hsv_jacobian(const double *x, const double *u, const hsv_vehicle *p, double *A, double *B);
/* Equilibria and small linear systems. */
void hsv_solve(int64_t n, int64_t m, double *A, double *b);
double hsv_balance(const hsv_vehicle *rigid, double path_angle, double acceleration, double pitch_rate, double *unknown,
                   double *x, double *u);
int64_t hsv_reference_steps(int64_t count, const double *corners, double period, int64_t *first);
void hsv_commands(int64_t count, const double *corners, double period, int climbing, int64_t first, int64_t rows,
                  double *command, double *rate, double *bend);
void hsv_reference_rows(const hsv_vehicle *rigid, int64_t rows, const double *command, const double *rate,
                        const double *bend, const double *guess, double period, int64_t substeps, double *state,
                        double *input, double *defect, double *imbalance);
int64_t hsv_steady_gain(const double *A, const double *B, double period, const double *process, const double *noise,
                        int64_t iterations, double settled, double *gain);
void hsv_transition(const double *A, const double *B, double period, double *F);
/* Equipment of one flight. */
void hsv_actuator_map(int64_t order, double frequency, double damping, double h, double *map);
void hsv_actuator_step(int64_t order, const double *map, const double *state, double command, double minimum,
                       double maximum, double rate_limit, double acceleration_limit, double h, double *out);
int64_t hsv_begin_faults(hsv_faults *faults, int64_t k, int64_t seed);
void hsv_apply_command_faults(hsv_faults *faults, int64_t k, int64_t seed, double *actuator);
void hsv_apply_engine_faults(hsv_faults *faults, int64_t k, int64_t seed, double alpha, double mach, double fuel,
                             double *engine);
void hsv_move_effectors(const hsv_actuators *actuators, double *state, hsv_faults *faults, int64_t k, double substep,
                        double length, const double *command, double alpha, double *effector);
void hsv_atmosphere_step(const hsv_atmosphere *air, double *memory, int64_t k, int64_t seed, double altitude,
                         double speed, double *conditions);
void hsv_dryden_cross_map(double r, double *map);
double hsv_gust_mean(double begin, double end, double length, int64_t stays);
void hsv_measure(const hsv_sensors *sensors, hsv_sensor_memory *memory, hsv_faults *faults, int64_t k, int64_t seed,
                 const double *x, double *measurement);
void hsv_fill_link(double *memory, int64_t size, const double *payload, int64_t n);
void hsv_receive(const hsv_link *link, double *memory, int64_t size, int64_t k, int64_t seed, double *payload,
                 int64_t n);
void hsv_sense(const hsv_plant *plant, hsv_plant_memory *memory, hsv_plant_faults *faults, int64_t k, const double *x,
               double *measurement);
void hsv_plant_conditions(const hsv_plant *plant, hsv_plant_memory *memory, hsv_plant_faults *faults, int64_t k,
                          const double *x, double fuel);
/* One step of each block of the loop. */
void hsv_advance_plant(const hsv_plant *plant, hsv_plant_memory *memory, hsv_plant_faults *faults, int64_t k,
                       const double *actuator, double *x);
void hsv_notch_rest(const hsv_notch *notch, double rate, double *s);
double hsv_notch_step(const hsv_notch *notch, double *s, double rate);
void hsv_estimate(const hsv_estimator *estimator, double *memory, int64_t k, const double *measurement,
                  const double *command, double *estimate);
int hsv_nominal_input(const hsv_nominal *nominal, const double *x_n, double *u_n, double *index);
int hsv_nominal_advance(const hsv_polytope *polytope, double altitude, double velocity, double *x_n, const double *u_n,
                        const double *d_r);
int64_t hsv_tube_step(const hsv_tube *tube, hsv_tube_memory *memory, int64_t k, int monitored, int64_t filter_states,
                      const double *x, double q_f, const double *x_r, const double *u_r, const double *x_n,
                      const double *u_n, const double *s, double *u_feedback, double *u_unsaturated, double *u);
double hsv_effectiveness_step(const hsv_effectiveness *effectiveness, hsv_tube_memory *memory, int64_t k,
                              const double *x);
void hsv_air_relative(double velocity, double path_angle, double forward, double up, double *out);
void hsv_effectiveness_bounds(const hsv_effectiveness *effectiveness, const double *step, double *bounds);
double hsv_level(const double *P, int64_t size, const double *x);
/* Simulation of one flight, or of one flight per lane of a vector register, over a range of steps. */
int hsv_widest(void);
int64_t hsv_memory_size(int64_t flights);
int64_t hsv_fly(int instructions, int64_t count, hsv_flight *const *flights, void *memory, int64_t start, int64_t stop,
                int halves);
/* Sequences of steps for design, governor and metrics. */
int hsv_schedule(const hsv_polytope *polytope, double altitude, double velocity, double *S);
int hsv_plan(const hsv_nominal *nominal, const hsv_reference *reference, int64_t first, int64_t steps,
             const double *start, double *plan, double *deviation);
void hsv_notch_along(const hsv_notch *notch, int64_t steps, const double *rate, double *filtered, double *states);
void hsv_respond(const hsv_sampled *actuators, int64_t steps, const double *commands, double *before, double *means);
void hsv_lag_response(const hsv_polytope *polytope, const double *gain, const hsv_notch *notch,
                      const hsv_sampled *actuators, int64_t steps, const double *scheduled, const double *lag,
                      double *errors, double *feedback);
void hsv_sample_sequences(int64_t vertices, int64_t rows, int64_t width, const double *columns, int64_t n,
                          const double *begin, int64_t first, int64_t end, int64_t steps, uint64_t seed, double *worst);
double hsv_levels(const hsv_tube_set *set, int64_t steps, const double *state, const double *deviation,
                  const double *reference, double *levels);
void hsv_curves(int64_t steps, int64_t stride, const double *history, const double *auxiliary, const double *reference,
                double *curves, uint8_t *saturated);
/* end */
void hsv_any_sine_cosine(double x, double *sine, double *cosine); /* for any argument, one lane at a time */

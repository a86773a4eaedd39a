/* A block of the HSV bench in C: what a shared library exports so that its function is stepped in the loop.
 *
 * A block is a constant of the type hsv_block under a symbol of its own. It says what goes in, what comes out, what it
 * keeps from step to step and which numbers it can be given; its function "step" is called once a control period:
 *
 *     #include "hsv_block.h"
 *
 *     static int32_t step(int64_t k, const double *in, double *out, double *state, const double *par)
 *     {
 *         out[HSV_FUEL_EQUIVALENCE_RATIO] = in[HSV_REFERENCE_INPUT + HSV_FUEL_EQUIVALENCE_RATIO];
 *         out[HSV_ELEVATOR_DEFLECTION] = par[0] * in[HSV_REFERENCE_INPUT + HSV_ELEVATOR_DEFLECTION];
 *         return 0;
 *     }
 *
 *     static const hsv_signal inputs[] = {HSV_CONTROLLER_INPUTS}, outputs[] = {HSV_CONTROLLER_OUTPUTS};
 *     static const double one = 1.0;
 *     static const hsv_parameter parameters[] = {
 *         {.name = "share", .unit = "1", .description = "times the elevator of the trim", .size = 1, .value = &one}};
 *
 *     const hsv_block trimmed = {
 *         .abi_version = HSV_BLOCK_ABI_VERSION, .name = "trimmed", .source = __FILE__, .step = step,
 *         .input_count = HSV_COUNT(inputs), .inputs = inputs,
 *         .output_count = HSV_COUNT(outputs), .outputs = outputs,
 *         .parameter_count = HSV_COUNT(parameters), .parameters = parameters};
 *
 *     cc -std=c99 -O2 -ffp-contract=off -shared -fPIC -I"$(hsv include)" -o trimmed.so trimmed.c
 *
 * A scenario flies it as its controller with controller = "trimmed.so:trimmed", the path from the scenario's folder;
 * its table [trimmed] then has the key "share".
 *
 * Plain C99. SI units and radians. "-ffp-contract=off" keeps a flight's bits the same on every processor.
 */
#ifndef HSV_BLOCK_H
#define HSV_BLOCK_H

#include <stdint.h>

/* Changes whenever a library built before would be misread. */
#define HSV_BLOCK_ABI_VERSION 1

#define HSV_COUNT(array) ((int64_t)(sizeof(array) / sizeof((array)[0])))

/* A signal: so many numbers, one after the other. */
typedef struct {
    const char *name; /* letters, digits and underscores */
    const char *unit; /* "1" where there is none; several, separated by ", ", are repeated number by number */
    int64_t size;
} hsv_signal;

/* Numbers that a scenario may give, in the table of the block's name. */
typedef struct {
    const char *name;        /* the key: letters, digits and underscores */
    const char *unit;        /* SI, "1" where there is none; a scenario may write another one of its kind */
    const char *description; /* in a few words */
    int64_t size;
    const double *value; /* (size) where a scenario gives none */
    double minimum;      /* least and largest admissible number; both 0: any */
    double maximum;
} hsv_parameter;

/* Compute step k = 0, 1, 2, ... of a run. Return 0; any other value ends the flight.
 *
 * in: the input signals, one after the other. out: the output signals; write all of them. state: the memory from step
 * to step, zero at k = 0. par: the parameters, one after the other. The four do not overlap; do not write in and par.
 * Keep no other memory (static variables, heap, random numbers): flights would no longer repeat.
 */
typedef int32_t (*hsv_step)(int64_t k, const double *in, double *out, double *state, const double *par);

typedef struct {
    int64_t abi_version; /* HSV_BLOCK_ABI_VERSION */
    const char *name;    /* letters, digits and underscores: names the block in messages, and its table in scenarios */
    const char *source;  /* path of its source from the library's folder, kept with recorded flights; NULL: none */
    hsv_step step;
    int64_t state_size;
    int64_t input_count;
    const hsv_signal *inputs;
    int64_t output_count;
    const hsv_signal *outputs;
    int64_t parameter_count;
    const hsv_parameter *parameters;
} hsv_block;

/* The order of a state of the vehicle, of its reference and of a deviation from it. */
enum {
    HSV_ALTITUDE,
    HSV_VELOCITY,
    HSV_ANGLE_OF_ATTACK,
    HSV_PITCH_ANGLE,
    HSV_PITCH_RATE,
    HSV_ELASTIC_COORDINATE_1,
    HSV_ELASTIC_RATE_1,
    HSV_ELASTIC_COORDINATE_2,
    HSV_ELASTIC_RATE_2,
    HSV_STATES
};
#define HSV_STATE_UNITS "m, m/s, rad, rad, rad/s, kg^0.5 m, kg^0.5 m/s, kg^0.5 m, kg^0.5 m/s"

/* The order of an input of the vehicle. */
enum { HSV_FUEL_EQUIVALENCE_RATIO, HSV_ELEVATOR_DEFLECTION, HSV_INPUTS };
#define HSV_INPUT_UNITS "1, rad"

/* Where a controller finds what it is given. */
enum {
    HSV_ESTIMATE = 0,                                        /* x, measured or estimated, pitch rate not filtered */
    HSV_FILTERED_PITCH_RATE = HSV_ESTIMATE + HSV_STATES,     /* q_f */
    HSV_REFERENCE = HSV_FILTERED_PITCH_RATE + 1,             /* x_r */
    HSV_REFERENCE_INPUT = HSV_REFERENCE + HSV_STATES,        /* u_r */
    HSV_DEVIATION = HSV_REFERENCE_INPUT + HSV_INPUTS,        /* x_n, zero without a design */
    HSV_NOMINAL_INPUT = HSV_DEVIATION + HSV_STATES,          /* u_n, zero without a design */
    HSV_FILTER_STATE = HSV_NOMINAL_INPUT + HSV_INPUTS        /* s before this step's update, two a section */
};

/* The inputs and outputs of a controller. It may leave out inputs at the end; HSV_FILTER_STATE_INPUT follows where it
 * reads the notch filter's state, with as many numbers as the filter has that it flies with. The output is the
 * unsaturated input of the vehicle, which the bench clips to its limits. */
#define HSV_CONTROLLER_INPUTS \
    {"estimate", HSV_STATE_UNITS, HSV_STATES}, \
    {"filtered_pitch_rate", "rad/s", 1}, \
    {"reference", HSV_STATE_UNITS, HSV_STATES}, \
    {"reference_input", HSV_INPUT_UNITS, HSV_INPUTS}, \
    {"deviation", HSV_STATE_UNITS, HSV_STATES}, \
    {"nominal_input", HSV_INPUT_UNITS, HSV_INPUTS}
#define HSV_FILTER_STATE_INPUT(size) {"filter_state", "rad, rad s", (size)}
#define HSV_CONTROLLER_OUTPUTS {"wanted_input", HSV_INPUT_UNITS, HSV_INPUTS}

#endif

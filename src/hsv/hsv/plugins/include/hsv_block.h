/* A block of the HSV bench in C, such as a controller: a shared library exports it, and the loop steps its function.
 *
 * A block is an exported constant of the type hsv_block. It declares inputs, outputs, the size of the state that it
 * keeps from step to step, and parameters. Its function "step" is called once per control period:
 *
 *     #include "hsv_block.h"
 *
 *     static int32_t step(int64_t k, const double *in, double *out, double *state, const double *par)
 *     {
 *         (void)k, (void)state;
 *         out[HSV_FUEL_EQUIVALENCE_RATIO] = in[HSV_REFERENCE_INPUT + HSV_FUEL_EQUIVALENCE_RATIO];
 *         out[HSV_ELEVATOR_DEFLECTION] = par[0] * in[HSV_REFERENCE_INPUT + HSV_ELEVATOR_DEFLECTION];
 *         return 0;
 *     }
 *
 *     static const hsv_signal inputs[] = {HSV_CONTROLLER_INPUTS}, outputs[] = {HSV_CONTROLLER_OUTPUTS};
 *     static const double one = 1.0;
 *     static const hsv_parameter parameters[] = {{"share", "1", "times the elevator of the trim", 1, &one, 0.0, 0.0}};
 *
 *     HSV_BLOCK(trimmed) = {
 *         HSV_BLOCK_ABI_VERSION, "trimmed", __FILE__, step, 0, HSV_COUNT(inputs), inputs,
 *         HSV_COUNT(outputs), outputs, HSV_COUNT(parameters), parameters};
 *
 *     cc -std=c99 -O2 -ffp-contract=off -shared -fPIC -I"$(hsv include)" -o trimmed.so trimmed.c
 *
 * A scenario uses it with controller = "trimmed.so:trimmed", where the path is relative to the folder of the scenario;
 * the table [trimmed] of the scenario then has the key "share".
 *
 * The language is C99, or C++ ("c++ -std=c++17" in place of "cc -std=c99"); units are SI, with angles in radians. With
 * "-ffp-contract=off" a flight has the same bits on every processor.
 */
#ifndef HSV_BLOCK_H
#define HSV_BLOCK_H

#include <stdint.h>

/* Version of these structs; it changes if libraries built with an older header would be misread. */
#define HSV_BLOCK_ABI_VERSION 1

#define HSV_COUNT(array) ((int64_t)(sizeof(array) / sizeof((array)[0])))

/* A signal: "size" consecutive numbers. */
typedef struct {
    const char *name; /* letters, digits and underscores */
    const char *unit; /* "1" if dimensionless; several units, separated by ", ", apply to the numbers in turn */
    int64_t size;
} hsv_signal;

/* A parameter: numbers that a scenario may set, in the table with the name of the block. */
typedef struct {
    const char *name;        /* the key: letters, digits and underscores */
    const char *unit;        /* SI unit, "1" if dimensionless; a scenario may use another unit of the same kind */
    const char *description; /* a few words */
    int64_t size;
    const double *value; /* (size) default values */
    double minimum;      /* smallest and largest admissible number; both 0: no limits */
    double maximum;
} hsv_parameter;

/* Compute step k = 0, 1, 2, ... of a run. Return 0; any other value ends the flight.
 *
 * in: the input signals, one after the other. out: the output signals; write all of them. state: kept from step to
 * step, zero at k = 0. par: the parameters, one after the other. The four arrays do not overlap; do not write to "in"
 * and "par". Keep no other state (static variables, heap, random numbers): flights would not be reproducible.
 */
typedef int32_t (*hsv_step)(int64_t k, const double *in, double *out, double *state, const double *par);

typedef struct {
    int64_t abi_version; /* HSV_BLOCK_ABI_VERSION */
    const char *name;    /* name in messages and of the table in scenarios: letters, digits and underscores */
    const char *source;  /* path of the source relative to the library, to be stored with recorded flights, or NULL */
    hsv_step step;
    int64_t state_size;
    int64_t input_count;
    const hsv_signal *inputs;
    int64_t output_count;
    const hsv_signal *outputs;
    int64_t parameter_count;
    const hsv_parameter *parameters;
} hsv_block;

/* Export a block: HSV_BLOCK(name) = {...}; where C++ would keep a constant to the file. */
#ifdef __cplusplus
#define HSV_BLOCK(name)                                                                                                \
    extern "C" {                                                                                                       \
    extern const hsv_block name;                                                                                       \
    }                                                                                                                  \
    const hsv_block name
#else
#define HSV_BLOCK(name)                                                                                                \
    extern const hsv_block name;                                                                                       \
    const hsv_block name
#endif

/* One enumeration, because C++ warns of sums of two. */
enum {
    /* Order of the entries of a vehicle state, of its reference and of a deviation from the reference. */
    HSV_ALTITUDE,
    HSV_VELOCITY,
    HSV_ANGLE_OF_ATTACK,
    HSV_PITCH_ANGLE,
    HSV_PITCH_RATE,
    HSV_ELASTIC_COORDINATE_1,
    HSV_ELASTIC_RATE_1,
    HSV_ELASTIC_COORDINATE_2,
    HSV_ELASTIC_RATE_2,
    HSV_STATES,
    /* Order of the entries of a vehicle input. */
    HSV_FUEL_EQUIVALENCE_RATIO = 0,
    HSV_ELEVATOR_DEFLECTION,
    HSV_INPUTS,
    /* Positions of the signals in the input "in" of a controller. */
    HSV_ESTIMATE = 0,                                    /* x, measured or estimated, pitch rate not filtered */
    HSV_FILTERED_PITCH_RATE = HSV_ESTIMATE + HSV_STATES, /* q_f */
    HSV_REFERENCE = HSV_FILTERED_PITCH_RATE + 1,         /* x_r */
    HSV_REFERENCE_INPUT = HSV_REFERENCE + HSV_STATES,    /* u_r */
    HSV_DEVIATION = HSV_REFERENCE_INPUT + HSV_INPUTS,    /* x_n, zero without a design */
    HSV_NOMINAL_INPUT = HSV_DEVIATION + HSV_STATES,      /* u_n, zero without a design */
    HSV_FILTER_STATE = HSV_NOMINAL_INPUT + HSV_INPUTS    /* s before this step's update, two a section */
};
#define HSV_STATE_UNITS "m, m/s, rad, rad, rad/s, kg^0.5 m, kg^0.5 m/s, kg^0.5 m, kg^0.5 m/s"
#define HSV_INPUT_UNITS "1, rad"

/* The inputs and outputs of a controller. It may omit inputs at the end. If it reads the state of the notch filter,
 * HSV_FILTER_STATE_INPUT follows; its size must be that of the filter in flight. The output is the unsaturated input of
 * the vehicle, which the bench clips to its limits. */
/* clang-format off */
#define HSV_CONTROLLER_INPUTS \
    {"estimate", HSV_STATE_UNITS, HSV_STATES}, \
    {"filtered_pitch_rate", "rad/s", 1}, \
    {"reference", HSV_STATE_UNITS, HSV_STATES}, \
    {"reference_input", HSV_INPUT_UNITS, HSV_INPUTS}, \
    {"deviation", HSV_STATE_UNITS, HSV_STATES}, \
    {"nominal_input", HSV_INPUT_UNITS, HSV_INPUTS}
#define HSV_FILTER_STATE_INPUT(size) {"filter_state", "rad, rad s", (size)}
#define HSV_CONTROLLER_OUTPUTS {"wanted_input", HSV_INPUT_UNITS, HSV_INPUTS}
/* clang-format on */

#endif

/* A controller for the tests: the input of the trim and a leaky integral of the pitch angle, and what can go wrong.
 *
 * Macros on the command line replace what the description says.
 */
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include "hsv_block.h"

#ifndef ABI
#define ABI HSV_BLOCK_ABI_VERSION
#endif
#ifndef NAME
#define NAME "probe"
#endif
#ifndef STEP
#define STEP step
#endif
#ifndef STATE_SIZE
#define STATE_SIZE 1
#endif
#ifndef INPUTS
#define INPUTS HSV_CONTROLLER_INPUTS
#endif
#ifndef INPUT_COUNT
#define INPUT_COUNT HSV_COUNT(inputs)
#endif
#ifndef OUTPUTS
#define OUTPUTS HSV_CONTROLLER_OUTPUTS
#endif
#ifndef WEIGHT_UNIT
#define WEIGHT_UNIT "1/s"
#endif
#ifndef WEIGHT
#define WEIGHT "weight"
#endif
#ifndef SOURCE
#define SOURCE "probe.c"
#endif

enum { WEIGHTS = 3, CRASH_AT = WEIGHTS, ABORT_AT, EXIT_AT, HANG_AT, FAIL_AT, SILENT_AT, CRASH_ABOVE };

static int32_t step(int64_t k, const double *in, double *out, double *state, const double *par)
{
    if (k == (int64_t)par[CRASH_AT] || in[HSV_ESTIMATE + HSV_ALTITUDE] > par[CRASH_ABOVE]) raise(SIGSEGV);
    if (k == (int64_t)par[ABORT_AT]) abort();
    if (k == (int64_t)par[EXIT_AT]) exit(3);
    while (k == (int64_t)par[HANG_AT]) pause();
    if (k == (int64_t)par[FAIL_AT]) return 7;
    if (k == (int64_t)par[SILENT_AT]) return 0;
    out[HSV_FUEL_EQUIVALENCE_RATIO] = in[HSV_REFERENCE_INPUT + HSV_FUEL_EQUIVALENCE_RATIO];
    out[HSV_ELEVATOR_DEFLECTION] = in[HSV_REFERENCE_INPUT + HSV_ELEVATOR_DEFLECTION] + par[0] * state[0];
#ifdef STATIC
    static double kept;
    out[HSV_ELEVATOR_DEFLECTION] += kept;
    kept = 1e-6;
#endif
    state[0] += par[1] * (in[HSV_ESTIMATE + HSV_PITCH_ANGLE] - in[HSV_REFERENCE + HSV_PITCH_ANGLE] - par[2] * state[0]);
#ifdef EXTRA
    EXTRA;
#endif
    return 0;
}

#ifdef CRASHES_ON_LOADING
__attribute__((constructor)) static void load(void) { raise(SIGSEGV); }
#endif

static const hsv_signal inputs[] = {INPUTS}, outputs[] = {OUTPUTS};
static const double weights[WEIGHTS] = {0.5, 0.02, 0.5}, never = -1.0, high = 1e9;
static const hsv_parameter parameters[] = {
    {WEIGHT, WEIGHT_UNIT, "of the integral", WEIGHTS, weights, -10.0, 10.0},
    {"crash_at", "1", "step", 1, &never, 0.0, 0.0},
    {"abort_at", "1", "step", 1, &never, 0.0, 0.0},
    {"exit_at", "1", "step", 1, &never, 0.0, 0.0},
    {"hang_at", "1", "step", 1, &never, 0.0, 0.0},
    {"fail_at", "1", "step", 1, &never, 0.0, 0.0},
    {"silent_at", "1", "step", 1, &never, 0.0, 0.0},
    {"crash_above", "m", "altitude", 1, &high, 0.0, 0.0},
};

const hsv_block probe = {
    ABI,       NAME, SOURCE, STEP, STATE_SIZE, INPUT_COUNT, inputs, HSV_COUNT(outputs), outputs, HSV_COUNT(parameters),
    parameters};

/* For the tests of the header itself. */
const int64_t offsets[] = {HSV_ESTIMATE,  HSV_FILTERED_PITCH_RATE, HSV_REFERENCE,   HSV_REFERENCE_INPUT,
                           HSV_DEVIATION, HSV_NOMINAL_INPUT,       HSV_FILTER_STATE};

/* Trims (paper eq. 5), the reference, and the steady-state gain of the estimator.
 *
 * They are computed before a flight, but the flight depends on their last bits. LAPACK is not used because the order of
 * its sums depends on the processor. */
#pragma once
#include "estimator.h"
#include "vehicle.h"

enum { ROOM = ESTIMATED * ESTIMATED };

/* Replace b (n, m) by the solution of A X = b, by elimination with partial pivoting; A (n, n) is overwritten. For a
 * singular A the solution is not finite. */
void hsv_solve(int64_t n, int64_t m, double *A, double *b)
{
    for (int64_t column = 0; column < n; column++) {
        int64_t pivot = column;
        for (int64_t row = column + 1; row < n; row++)
            if (magnitude(A[n * row + column]) > magnitude(A[n * pivot + column])) pivot = row;
        for (int64_t j = 0; pivot != column && j < n + m; j++) {
            double *first = j < n ? &A[n * column + j] : &b[m * column + j - n];
            double *second = j < n ? &A[n * pivot + j] : &b[m * pivot + j - n], swapped = *first;
            *first = *second, *second = swapped;
        }
        for (int64_t row = column + 1; row < n; row++) {
            const double share = A[n * row + column] / A[n * column + column];
            for (int64_t j = column; j < n; j++) A[n * row + j] -= share * A[n * column + j];
            for (int64_t j = 0; j < m; j++) b[m * row + j] -= share * b[m * column + j];
        }
    }
    for (int64_t row = n - 1; row >= 0; row--)
        for (int64_t j = 0; j < m; j++) {
            for (int64_t k = row + 1; k < n; k++) b[m * row + j] -= A[n * row + k] * b[m * k + j];
            b[m * row + j] /= A[n * row + row];
        }
}

/* Write the trim x (9), u (2) at the altitude and velocity given in x; return its largest residual (SI per second).
 *
 * Newton's method with exact derivatives solves dV/dt = acceleration (m/s^2), dalpha/dt = 0 and dq/dt = 0 for "unknown"
 * (3): angle of attack, equivalence ratio and elevator. "unknown" contains the initial guess and, on return, the best
 * solution. theta is alpha plus the path angle (rad); the pitch rate (rad/s) is that of a steady pull-up. The elastic
 * coordinates are N_i / omega_i^2: at trim the pitching moment is zero, so that inertial coupling has no effect, and
 * "rigid", the vehicle without coupling, suffices. */
double hsv_balance(const hsv_vehicle *rigid, double path_angle, double acceleration, double pitch_rate, double *unknown,
                   double *x, double *u)
{
    static const int rows[3] = {VELOCITY, ALPHA, PITCH_RATE};
    const double converged = 1e-9;
    const Vehicle *vehicle = (const Vehicle *)rigid;
    double rates[STATES], A[STATES * STATES], B[STATES * INPUTS], slope[9], right[3], trial[3];
    double best = INFINITY;
    memcpy(trial, unknown, sizeof trial);
    for (int i = PITCH_RATE; i < STATES; i++) x[i] = 0.0;
    x[PITCH_RATE] = pitch_rate;
    for (int iteration = 0; iteration < 60; iteration++) {
        x[ALPHA] = trial[0], x[PITCH] = trial[0] + path_angle;
        u[FUEL] = trial[1], u[ELEVATOR] = trial[2];
        derivative(x, u, vehicle, NULL, rates);
        rates[VELOCITY] -= acceleration;
        const double size =
            maximum(maximum(magnitude(rates[VELOCITY]), magnitude(rates[ALPHA])), magnitude(rates[PITCH_RATE]));
        if (!is_finite(size) || (size >= best && best < converged)) /* converged up to rounding errors */
            break;
        if (size < best) {
            memcpy(unknown, trial, sizeof trial);
            best = size;
        }
        hsv_jacobian(x, u, rigid, A, B);
        for (int i = 0; i < 3; i++) {
            /* The path angle is given, so that pitch angle and angle of attack change together. */
            slope[3 * i] = A[STATES * rows[i] + ALPHA] + A[STATES * rows[i] + PITCH];
            for (int j = 0; j < INPUTS; j++) slope[3 * i + 1 + j] = B[INPUTS * rows[i] + j];
            right[i] = rates[rows[i]];
        }
        hsv_solve(3, 1, slope, right);
        for (int i = 0; i < 3; i++) trial[i] -= right[i];
    }
    x[ALPHA] = unknown[0], x[PITCH] = unknown[0] + path_angle;
    u[FUEL] = unknown[1], u[ELEVATOR] = unknown[2];
    /* At zero elastic coordinates, the elastic accelerations of the decoupled model are the generalised forces N_i. */
    derivative(x, u, vehicle, NULL, rates);
    x[ETA_1] = rates[ETA_1_RATE] / (rigid->natural_frequency_1 * rigid->natural_frequency_1);
    x[ETA_2] = rates[ETA_2_RATE] / (rigid->natural_frequency_2 * rigid->natural_frequency_2);
    return best;
}

static int equal(const double *a, const double *b) { return a[0] == b[0] && a[1] == b[1]; }

enum { CORNER = 4 }; /* numbers of a corner of the commands: time, altitude, velocity, half-width of its blend */

/* Return a time (s) in steps; a value that differs from an integer only by rounding becomes that integer. */
static double in_steps(double time, double period)
{
    const double steps = time / period, nearest = (steps + 0x1.8p52) - 0x1.8p52;
    return magnitude(steps - nearest) < 1e-9 * maximum(1.0, nearest) ? nearest : steps;
}

static int64_t rounded_up(double x) { return (int64_t)x + ((double)(int64_t)x < x); }

/* Return the number of steps from before the first to after the last of the corners (count, 4); write the first. */
int64_t hsv_reference_steps(int64_t count, const double *corners, double period, int64_t *first)
{
    const double *last = corners + CORNER * (count - 1);
    const int64_t begin = rounded_up(in_steps(corners[0], period) - corners[3] / period) - 2;
    const int64_t end = rounded_up(in_steps(last[0], period) + last[3] / period);
    *first = begin > 0 ? begin : 0;
    return (end > *first ? end : *first) + 1 - *first;
}

/* Write the commands of altitude and velocity (rows, 2) from step "first" on, their rates (rows, 2) and the vertical
 * acceleration (rows): linear between the corners (count, 4), which are blended as hsv.control.reference_trajectory
 * explains. A static trim has neither climb rate nor acceleration nor turn. */
void hsv_commands(int64_t count, const double *corners, double period, int climbing, int64_t first, int64_t rows,
                  double *command, double *rate, double *bend)
{
    for (int64_t row = 0, passed = 0; row < rows; row++) {
        const double k = (double)(first + row);
        while (passed < count && in_steps(corners[CORNER * passed], period) <= k) passed++;
        const double *start = corners + CORNER * (passed > 0 ? passed - 1 : 0), *stop = start + CORNER;
        const double begun = in_steps(start[0], period);
        for (int j = 0; j < 2; j++) {
            const double slope =
                passed > 0 && passed < count ? (stop[1 + j] - start[1 + j]) / (in_steps(stop[0], period) - begun) : 0.0;
            command[2 * row + j] = start[1 + j] + slope * (k - begun);
            rate[2 * row + j] = slope;
        }
        bend[row] = 0.0;
    }
    double change[2], before[2] = {0.0, 0.0};
    for (const double *corner = corners, *end = corners + CORNER * count; corner < end; corner += CORNER) {
        const double at = in_steps(corner[0], period), width = corner[3] / period;
        const double length = corner + CORNER < end ? in_steps(corner[CORNER], period) - at : 0.0;
        for (int j = 0; j < 2; j++) {
            const double after = length > 0.0 ? (corner[CORNER + 1 + j] - corner[1 + j]) / length : 0.0;
            change[j] = after - before[j], before[j] = after;
        }
        for (int64_t row = 0; row < rows && width != 0.0; row++) {
            const double since = (double)(first + row) - at, left = maximum(width - magnitude(since), 0.0);
            for (int j = 0; j < 2; j++) {
                command[2 * row + j] += change[j] * (left * left * left / (6.0 * width * width));
                rate[2 * row + j] += (since < 0.0 ? change[j] : -change[j]) * (left * left / (2.0 * width * width));
            }
            bend[row] += change[0] * (left / (width * width));
        }
    }
    const double moving = climbing ? 1.0 : 0.0;
    for (int64_t i = 0; i < 2 * rows; i++) rate[i] = moving * (rate[i] / period);
    for (int64_t i = 0; i < rows; i++) bend[i] = moving * (bend[i] / (period * period));
}

/* Write x_r (rows, 9), u_r (rows, 2), the defect d_r (rows, 9) and the residuals of the trims (rows), for commands of
 * altitude and velocity (rows, 2), their rates (rows, 2), and the vertical acceleration "bend" (rows). A row of d_r is
 * the state one period after x_r with u_r held, minus the next x_r. "guess" (3) starts Newton's method. */
void hsv_reference_rows(const hsv_vehicle *rigid, int64_t rows, const double *command, const double *rate,
                        const double *bend, const double *guess, double period, int64_t substeps, double *state,
                        double *input, double *defect, double *imbalance)
{
    static const double still[2] = {0.0, 0.0};
    for (int64_t k = 0; k < rows; k++) {
        double *x = state + STATES * k, *u = input + INPUTS * k;
        const double *now = command + 2 * k, *climb = rate + 2 * k;
        if (k > 0 && equal(now, now - 2) && equal(climb, climb - 2)) {
            memcpy(x, x - STATES, STATES * sizeof *x);
            memcpy(u, u - INPUTS, INPUTS * sizeof *u);
            imbalance[k] = imbalance[k - 1];
            continue;
        }
        x[ALTITUDE] = now[0], x[VELOCITY] = now[1];
        const double sine = climb[0] / now[1];
        if (!(magnitude(sine) < 1.0)) {
            imbalance[k] = INFINITY;
            continue;
        }
        /* The previous trim would be a better guess, but the last bits of the result would then depend on it. */
        double unknown[3] = {guess[0], guess[1], guess[2]};
        const double turn = bend[k] / (now[1] * root(1.0 - sine * sine));
        imbalance[k] = hsv_balance(rigid, hsv_arcsine(sine), climb[1], turn, unknown, x, u);
    }
    for (int64_t k = 0; k < rows; k++) {
        double *d = defect + STATES * k, flown[STATES];
        const double *x = state + STATES * k, *now = command + 2 * k, *climb = rate + 2 * k;
        memset(d, 0, sizeof flown);
        if (k + 1 == rows || (equal(now, now + 2) && equal(climb, still) && equal(climb + 2, still))) continue;
        memcpy(flown, x, sizeof flown);
        advance(flown, input + INPUTS * k, (const Vehicle *)rigid, NULL, period, substeps);
        for (int i = 0; i < STATES; i++) d[i] = flown[i] - x[STATES + i];
    }
}

/* Write the product A B of A (n, m) and B (m, p), summed in the order of the columns of A. */
static void multiply(int n, int m, int p, const double *A, const double *B, double *product)
{
    memset(product, 0, (size_t)(n * p) * sizeof *product);
    for (int i = 0; i < n; i++)
        for (int k = 0; k < m; k++)
            for (int j = 0; j < p; j++) product[p * i + j] += A[m * i + k] * B[p * k + j];
}

/* Write the transition matrix F (11, 11) of states and held inputs over a period (s), by the power series, for
 * continuous-time A (9, 9) and B (9, 2). The eigenvalues of A times the period must be at most a few. */
void hsv_transition(const double *A, const double *B, double period, double *F)
{
    const int n = ESTIMATED;
    double rates[ROOM] = {0}, term[ROOM] = {0}, next[ROOM];
    for (int i = 0; i < STATES; i++) {
        for (int j = 0; j < STATES; j++) rates[n * i + j] = A[STATES * i + j] * period;
        for (int j = 0; j < INPUTS; j++) rates[n * i + STATES + j] = B[INPUTS * i + j] * period;
    }
    for (int i = 0; i < n; i++) term[(n + 1) * i] = 1.0;
    memcpy(F, term, sizeof term);
    for (int order = 1; order < 25; order++) {
        multiply(n, n, n, term, rates, next);
        for (int i = 0; i < n * n; i++) {
            term[i] = next[i] / order;
            F[i] += term[i];
        }
    }
}

/* Iterate the Riccati equation and write the steady-state gain (11, 5) of states and input offsets; return the number
 * of iterations.
 *
 * process (11): standard deviation of the process noise in a period; noise (5): standard deviation of the measurements;
 * settled: relative change of the gain in an iteration at which to stop. */
int64_t hsv_steady_gain(const double *A, const double *B, double period, const double *process, const double *noise,
                        int64_t iterations, double settled, double *gain)
{
    const int n = ESTIMATED, r = RIGID;
    double F[ROOM], F_t[ROOM], P[ROOM] = {0}, M[ROOM], product[ROOM], S[RIGID * RIGID], right[RIGID * ESTIMATED];
    hsv_transition(A, B, period, F);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) F_t[n * j + i] = F[n * i + j];
    memset(gain, 0, (size_t)(n * r) * sizeof *gain);
    for (int64_t iteration = 0; iteration < iterations; iteration++) {
        multiply(n, n, n, F, P, product);
        multiply(n, n, n, product, F_t, M);
        for (int i = 0; i < n; i++) M[(n + 1) * i] += process[i] * process[i];
        for (int i = 0; i < r; i++) {
            for (int j = 0; j < r; j++) S[r * i + j] = M[n * i + j] + (i == j ? noise[i] * noise[i] : 0.0);
            for (int j = 0; j < n; j++) right[n * i + j] = M[n * j + i];
        }
        hsv_solve(r, n, S, right);
        double change = 0.0;
        for (int j = 0; j < r; j++) {
            double greatest = 0.0, moved = 0.0;
            for (int i = 0; i < n; i++) {
                const double found = right[n * j + i];
                greatest = maximum(greatest, magnitude(found));
                moved = maximum(moved, magnitude(found - gain[r * i + j]));
                gain[r * i + j] = found;
            }
            change = maximum(change, moved / greatest);
        }
        multiply(n, r, n, gain, M, product);
        for (int i = 0; i < n; i++)
            for (int j = 0; j <= i; j++)
                P[n * i + j] = P[n * j + i] =
                    0.5 * ((M[n * i + j] - product[n * i + j]) + (M[n * j + i] - product[n * j + i]));
        if (change <= settled) return iteration + 1;
    }
    return iterations;
}

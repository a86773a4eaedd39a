/* The in-process flight of the compiled loop, written in C: the yardstick of "hsv bench".
 *
 * The same arithmetic in the same order as hsv.simulation.closed_loop._fly and what it calls, so that, without
 * contraction, the results can be compared bit by bit. Names are those of the Python sources.
 */
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { N = 9, M = 2, WIDTH = N * (N + M), MAX_SECTIONS = 4, PITCH_RATE = 4 };

/* In the order of hsv.vehicle.parameters.VehicleParameters. */
typedef struct {
    double mass, moment_of_inertia, gravity, reference_area, mean_aerodynamic_chord, thrust_moment_arm;
    double reference_density, reference_altitude, density_scale_height;
    double lift_alpha, lift_elevator, lift_zero;
    double drag_alpha_squared, drag_alpha, drag_elevator_squared, drag_elevator, drag_zero;
    double moment_alpha_squared, moment_alpha, moment_zero, moment_elevator;
    double thrust_beta_1, thrust_beta_2, thrust_beta_3, thrust_beta_4;
    double thrust_beta_5, thrust_beta_6, thrust_beta_7, thrust_beta_8;
    double elastic_force_1_alpha_squared, elastic_force_1_alpha, elastic_force_1_zero;
    double elastic_force_2_alpha_squared, elastic_force_2_alpha, elastic_force_2_elevator, elastic_force_2_zero;
    double damping_ratio_1, damping_ratio_2, natural_frequency_1, natural_frequency_2;
    double inertial_coupling_1, inertial_coupling_2;
} Vehicle;

typedef struct {
    int64_t sections;
    const double *A, *B, *C, *D, *G;
} Notch;

typedef struct {
    int64_t pieces, vertices;
    const double *breakpoints, *coefficients;
} Axis;

typedef struct {
    const double *S;
    Axis altitude, velocity;
} Polytope;

typedef struct {
    int64_t count, size;
    const double *gains, *ellipsoids;
} Family;

typedef struct {
    int64_t gain_count, filtered;
    const int64_t *starts;
    const double *gains, *minimum, *maximum;
    Notch notch;
} Tube;

typedef struct {
    int64_t count;
    const int64_t *start, *stop, *channel, *code;
    const double *value;
} Faults;

typedef struct {
    int64_t first, rows;
    const double *state, *input, *defect;
} Reference;

typedef struct {
    int64_t rows;
    double *state, *filtered_pitch_rate, *deviation, *nominal_input, *gain_index, *u_unsaturated, *command, *actuator;
} History;

static void derivative(const double *x, const double *u, const Vehicle *p, double *out)
{
    const double altitude = x[0], velocity = x[1], alpha = x[2], pitch = x[3], rate = x[4];
    const double fuel = u[0], elevator = u[1];
    const double density = p->reference_density * exp(-(altitude - p->reference_altitude) / p->density_scale_height);
    const double pressure = 0.5 * density * velocity * velocity;
    const double alpha2 = alpha * alpha;
    const double lift =
        pressure * p->reference_area * (p->lift_alpha * alpha + p->lift_elevator * elevator + p->lift_zero);
    const double drag = pressure * p->reference_area *
                        (p->drag_alpha_squared * alpha2 + p->drag_alpha * alpha +
                         p->drag_elevator_squared * elevator * elevator + p->drag_elevator * elevator + p->drag_zero);
    const double thrust = (p->thrust_beta_1 * fuel + p->thrust_beta_2) * alpha2 * alpha +
                          (p->thrust_beta_3 * fuel + p->thrust_beta_4) * alpha2 +
                          (p->thrust_beta_5 * fuel + p->thrust_beta_6) * alpha +
                          (p->thrust_beta_7 * fuel + p->thrust_beta_8);
    const double moment = p->thrust_moment_arm * thrust +
                          pressure * p->reference_area * p->mean_aerodynamic_chord *
                              (p->moment_alpha_squared * alpha2 + p->moment_alpha * alpha + p->moment_zero +
                               p->moment_elevator * elevator);

    const double force_1 =
        p->elastic_force_1_alpha_squared * alpha2 + p->elastic_force_1_alpha * alpha + p->elastic_force_1_zero;
    const double force_2 = p->elastic_force_2_alpha_squared * alpha2 + p->elastic_force_2_alpha * alpha +
                           p->elastic_force_2_elevator * elevator + p->elastic_force_2_zero;
    const double psi_1 = p->inertial_coupling_1, psi_2 = p->inertial_coupling_2;
    const double c_1 = psi_1 / p->moment_of_inertia, c_2 = psi_2 / p->moment_of_inertia;
    const double angular = moment / p->moment_of_inertia;
    const double omega_1 = p->natural_frequency_1, omega_2 = p->natural_frequency_2;
    const double k_1 = 1.0 + psi_1 * c_1;
    const double k_2 = 1.0 + psi_2 * c_2;
    const double k_12 = psi_1 * c_2;
    const double right_1 =
        -2.0 * p->damping_ratio_1 * omega_1 * x[6] - omega_1 * omega_1 * x[5] + force_1 - psi_1 * angular;
    const double right_2 =
        -2.0 * p->damping_ratio_2 * omega_2 * x[8] - omega_2 * omega_2 * x[7] + force_2 - psi_2 * angular;
    const double determinant = k_1 * k_2 - k_12 * k_12;
    const double acceleration_1 = (k_2 * right_1 - k_12 * right_2) / determinant;
    const double acceleration_2 = (k_1 * right_2 - k_12 * right_1) / determinant;

    const double sin_alpha = sin(alpha), cos_alpha = cos(alpha);
    const double sin_path = sin(pitch - alpha), cos_path = cos(pitch - alpha);
    out[0] = velocity * sin_path;
    out[1] = (thrust * cos_alpha - drag) / p->mass - p->gravity * sin_path;
    out[2] = (-thrust * sin_alpha - lift) / (p->mass * velocity) + rate + p->gravity / velocity * cos_path;
    out[3] = rate;
    out[4] = angular + c_1 * acceleration_1 + c_2 * acceleration_2;
    out[5] = x[6];
    out[6] = acceleration_1;
    out[7] = x[8];
    out[8] = acceleration_2;
}

static void advance(double *x, const double *u, const Vehicle *p, double period, int64_t substeps)
{
    const double h = period / (double)substeps;
    double slope[N], point[N], total[N];
    for (int64_t step = 0; step < substeps; step++) {
        derivative(x, u, p, slope);
        for (int i = 0; i < N; i++) {
            total[i] = slope[i];
            point[i] = x[i] + 0.5 * h * slope[i];
        }
        derivative(point, u, p, slope);
        for (int i = 0; i < N; i++) {
            total[i] += 2.0 * slope[i];
            point[i] = x[i] + 0.5 * h * slope[i];
        }
        derivative(point, u, p, slope);
        for (int i = 0; i < N; i++) {
            total[i] += 2.0 * slope[i];
            point[i] = x[i] + h * slope[i];
        }
        derivative(point, u, p, slope);
        for (int i = 0; i < N; i++)
            x[i] += h / 6.0 * (total[i] + slope[i]);
    }
}

static void rest(const Notch *notch, double value, double *state)
{
    for (int64_t i = 0; i < notch->sections; i++) {
        state[2 * i] = notch->G[2 * i] * value;
        state[2 * i + 1] = notch->G[2 * i + 1] * value;
    }
}

static double filter_step(const Notch *notch, double *state, double value)
{
    for (int64_t i = 0; i < notch->sections; i++) {
        const double *A = notch->A + 4 * i, *B = notch->B + 2 * i, *C = notch->C + 2 * i;
        const double a = state[2 * i], b = state[2 * i + 1];
        const double output = C[0] * a + C[1] * b + notch->D[i] * value;
        state[2 * i] = A[0] * a + A[1] * b + B[0] * value;
        state[2 * i + 1] = A[2] * a + A[3] * b + B[1] * value;
        value = output;
    }
    return value;
}

static double level(const double *ellipsoid, int64_t size, const double *x)
{
    double total = 0.0;
    for (int64_t i = 0; i < size; i++) {
        double row = 0.0;
        for (int64_t j = 0; j < size; j++)
            row += ellipsoid[i * size + j] * x[j];
        total += x[i] * row;
    }
    return total;
}

static int64_t nominal_input(const Family *family, const double *deviation, double *u_n)
{
    int64_t index = 0;
    for (int64_t g = family->count - 1; g >= 0; g--)
        if (level(family->ellipsoids + g * family->size * family->size, family->size, deviation) <= 1.0 + 1e-6) {
            index = g;
            break;
        }
    const double *gain = family->gains + index * M * N;
    for (int i = 0; i < M; i++) {
        u_n[i] = 0.0;
        for (int j = 0; j < N; j++)
            u_n[i] += gain[i * N + j] * deviation[j];
    }
    return index;
}

static double clamp(double value, double low, double high)
{
    if (!(value > low))
        return low;
    return value > high ? high : value;
}

static int64_t piece(const Axis *axis, double value)
{
    int64_t i = 0;
    while (i < axis->pieces - 1 && value >= axis->breakpoints[i + 1])
        i++;
    return i;
}

static double weight(const Axis *axis, int64_t piece, double local, int64_t vertex)
{
    const double *c = axis->coefficients + piece * axis->vertices + vertex;
    const int64_t power = axis->pieces * axis->vertices;
    return ((c[0] * local + c[power]) * local + c[2 * power]) * local + c[3 * power];
}

static void schedule(const Polytope *polytope, double altitude, double velocity, double *restrict S)
{
    const Axis *h_axis = &polytope->altitude, *v_axis = &polytope->velocity;
    const double h = clamp(altitude, h_axis->breakpoints[0], h_axis->breakpoints[h_axis->pieces]);
    const double v = clamp(velocity, v_axis->breakpoints[0], v_axis->breakpoints[v_axis->pieces]);
    const int64_t h_piece = piece(h_axis, h), v_piece = piece(v_axis, v);
    const double h_local = h - h_axis->breakpoints[h_piece], v_local = v - v_axis->breakpoints[v_piece];
    memset(S, 0, WIDTH * sizeof *S);
    for (int64_t i = 0; i < h_axis->vertices; i++) {
        const double h_weight = weight(h_axis, h_piece, h_local, i);
        for (int64_t j = 0; j < v_axis->vertices; j++) {
            const double both = h_weight * weight(v_axis, v_piece, v_local, j);
            const double *vertex = polytope->S + (i * v_axis->vertices + j) * WIDTH;
            for (int e = 0; e < WIDTH; e++)
                S[e] += both * vertex[e];
        }
    }
}

static void nominal_advance(const Polytope *polytope, double altitude, double velocity, double *deviation,
                            const double *u_n, const double *defect)
{
    double S[WIDTH], new[N];
    schedule(polytope, altitude, velocity, S);
    for (int i = 0; i < N; i++) {
        const double *row = S + i * (N + M);
        double total = 0.0;
        for (int j = 0; j < N; j++)
            total += row[j] * deviation[j];
        for (int j = 0; j < M; j++)
            total += row[N + j] * u_n[j];
        new[i] = total + defect[i];
    }
    memcpy(deviation, new, sizeof new);
}

static int64_t active_gain(const Tube *tube, int64_t step)
{
    int64_t index = 0;
    while (index + 1 < tube->gain_count && tube->starts[index + 1] <= step)
        index++;
    return index;
}

static void tube_input(const Tube *tube, int64_t active, const double *x, double pitch_rate_error, const double *x_r,
                       const double *x_n, const double *u_n, const double *u_r, double *u_total, double *u)
{
    const double *gain = tube->gains + active * M * N;
    for (int i = 0; i < M; i++) {
        double feedback = 0.0;
        for (int j = 0; j < N; j++) {
            const double error = j == PITCH_RATE ? pitch_rate_error : x[j] - x_n[j] - x_r[j];
            feedback += gain[i * N + j] * error;
        }
        u_total[i] = feedback + u_n[i] + u_r[i];
        const double wanted = isfinite(u_total[i]) ? u_total[i] : u_r[i];
        const double above = wanted > tube->minimum[i] ? wanted : tube->minimum[i];
        u[i] = above < tube->maximum[i] ? above : tube->maximum[i];
    }
}

static void apply_faults(const Faults *faults, int64_t step, const double *command, double *actuator)
{
    memcpy(actuator, command, M * sizeof *actuator);
    for (int64_t row = 0; row < faults->count; row++)
        if (faults->start[row] <= step && step < faults->stop[row] && faults->code[row] == 0)
            actuator[faults->channel[row]] = faults->value[row] * command[faults->channel[row]];
}

static int64_t reference_row(const Reference *reference, int64_t step)
{
    const int64_t row = step > reference->first ? step - reference->first : 0;
    return row < reference->rows ? row : reference->rows - 1;
}

static int in_model_range(const double *x, double angle_limit)
{
    for (int i = 0; i < N; i++)
        if (!isfinite(x[i]))
            return 0;
    return fabs(x[2]) <= angle_limit && fabs(x[3]) <= angle_limit && x[1] > 0.0;
}

/* Fly as many steps as there are rows, from x; return the number of rows written (fewer: diverged). */
int64_t fly(const Vehicle *vehicle, double period, int64_t substeps, double angle_limit, const Notch *notch,
            const Polytope *polytope, const Family *family, const Tube *tube, const Faults *faults,
            const Reference *reference, double *x, const History *history)
{
    double filter_state[2 * MAX_SECTIONS], planned_state[2 * MAX_SECTIONS], x_n[N], u_n[M], total[M], u[M], actuator[M];
    rest(notch, x[PITCH_RATE], filter_state);
    memcpy(planned_state, filter_state, 2 * notch->sections * sizeof *planned_state);
    const int filtered = tube->filtered && notch->sections > 0 && notch->sections == tube->notch.sections;
    const double *start = reference->state + reference_row(reference, 0) * N;
    for (int i = 0; i < N; i++)
        x_n[i] = x[i] - start[i];
    for (int64_t k = 0; k < history->rows; k++) {
        if (k > 0)
            advance(x, actuator, vehicle, period, substeps);
        const int64_t row = reference_row(reference, k);
        const double *x_r = reference->state + row * N, *u_r = reference->input + row * M;
        memcpy(history->state + k * N, x, sizeof(double[N]));
        const double q_f = filter_step(notch, filter_state, x[PITCH_RATE]);
        history->filtered_pitch_rate[k] = q_f;
        memcpy(history->deviation + k * N, x_n, sizeof x_n);
        history->gain_index[k] = (double)nominal_input(family, x_n, u_n);
        memcpy(history->nominal_input + k * M, u_n, sizeof u_n);
        const double pitch_rate_error =
            filtered ? q_f - filter_step(&tube->notch, planned_state, x_r[PITCH_RATE] + x_n[PITCH_RATE])
                     : q_f - x_n[PITCH_RATE] - x_r[PITCH_RATE];
        tube_input(tube, active_gain(tube, k), x, pitch_rate_error, x_r, x_n, u_n, u_r, total, u);
        memcpy(history->u_unsaturated + k * M, total, sizeof total);
        memcpy(history->command + k * M, u, sizeof u);
        nominal_advance(polytope, x[0], x[1], x_n, u_n, reference->defect + row * N);
        apply_faults(faults, k, u, actuator);
        memcpy(history->actuator + k * M, actuator, sizeof actuator);
        if (!in_model_range(x, angle_limit))
            return k + 1;
    }
    return history->rows;
}

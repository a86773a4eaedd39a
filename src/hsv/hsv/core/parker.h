/* Forces and moment of the air-breathing vehicle of Parker et al. (2007): curve fits (paper eq. 2, eq. 3).
 *
 *   L = q_bar S C_L(alpha, delta_e), D = q_bar S C_D(alpha, delta_e), M = z_T T + q_bar S c C_M(alpha, delta_e),
 *   T = C_T3 alpha^3 + C_T2 alpha^2 + C_T1 alpha + C_T0, each C_Ti affine in the fuel ratio phi (beta_1 ... beta_8),
 *   dynamic pressure q_bar = rho V^2 / 2, density rho = rho_0 exp(-(h - h_0) / h_s).
 *
 * The generalised forces N_i are in vehicle.h. The thrust term of the moment and the exponent of the density differ
 * from the printed equations, see docs/errata.md. The earth is flat. Included by vehicle.h. */
static inline Forces parker_forces(real altitude, real velocity, real alpha, const real *u, const Vehicle *p)
{
    const real fuel = u[FUEL], elevator = u[ELEVATOR];
    const real density =
        p->reference_density * exponential(-(altitude - p->reference_altitude) / p->density_scale_height);
    const real pressure = 0.5 * density * velocity * velocity;
    const real alpha2 = alpha * alpha;
    Forces f;
    f.pressure = pressure;
    f.lift = pressure * p->reference_area * (p->lift_alpha * alpha + p->lift_elevator * elevator + p->lift_zero);
    f.drag = pressure * p->reference_area *
             (p->drag_alpha_squared * alpha2 + p->drag_alpha * alpha + p->drag_elevator_squared * elevator * elevator +
              p->drag_elevator * elevator + p->drag_zero);
    f.thrust = (p->thrust_beta_1 * fuel + p->thrust_beta_2) * alpha2 * alpha +
               (p->thrust_beta_3 * fuel + p->thrust_beta_4) * alpha2 +
               (p->thrust_beta_5 * fuel + p->thrust_beta_6) * alpha + (p->thrust_beta_7 * fuel + p->thrust_beta_8);
    f.moment = p->thrust_moment_arm * f.thrust + pressure * p->reference_area * p->mean_aerodynamic_chord *
                                                     (p->moment_alpha_squared * alpha2 + p->moment_alpha * alpha +
                                                      p->moment_zero + p->moment_elevator * elevator);
    return f;
}

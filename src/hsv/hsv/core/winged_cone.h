/* Forces and moment of the rigid Winged-Cone (Wang and Stengel, J. Guidance, Control, and Dynamics 23(4), 2000; the
 * vehicle of NASA TM-102610). The coefficients depend on the Mach number M = V / a. In
 *
 *   L = q_bar S C_L,  D = q_bar S C_D,  T = q_bar S C_T,  moment q_bar S c C_M,  q_bar = rho V^2 / 2,
 *
 * the coefficients are
 *
 *   C_L = alpha (c_0 + c_1 / M) + (l_2 alpha^2 + l_1 alpha + l_0) delta_e,
 *   C_D = c_D (a_2 alpha^2 + a_1 alpha + 1) (m_2 M^2 + m_1 M + 1),
 *   C_T = c_T (1 + c_M / M) (1 + e) phi, and c_T (1 + c_M / M) (1 + e phi) for phi > 1,
 *   C_M = c_m (b_M - exp(-M / M_0)) (b_2 alpha^2 + b_1 alpha + b_0) + c_e (delta_e - alpha)
 *       + c q / (2 V) (d_M M + d_0) (d_2 alpha^2 + d_1 alpha + d_q),
 *
 * with density rho = rho_0 exp(-(h - h_0) / h_s), speed of sound a = s_2 h^2 + s_1 h + s_0, gravity mu / r^2 and its
 * centrifugal relief V^2 / r, r = R + h. The thrust has no moment. Wang and Stengel have no lift of the elevator,
 * l_2 = l_1 = l_0 = 0. Included by vehicle.h. */
static inline real winged_cone_sound(real altitude, const Vehicle *p)
{
    return (p->sound_speed_curvature * altitude + p->sound_speed_slope) * altitude + p->sound_speed_zero;
}

/* Not inlined, because it would take registers from Parker's equations. */
static __attribute__((noinline)) Forces winged_cone_forces(real altitude, real velocity, real alpha, real rate,
                                                           const real *u, const Vehicle *p)
{
    const real fuel = u[FUEL], elevator = u[ELEVATOR];
    const real density =
        p->reference_density * exponential(-(altitude - p->reference_altitude) / p->density_scale_height);
    const real mach = velocity / winged_cone_sound(altitude, p);
    const real pressure = 0.5 * density * velocity * velocity, force = pressure * p->reference_area;
    const real alpha2 = alpha * alpha;
    const real static_moment = p->moment_scale * (p->moment_mach - exponential(-mach / p->moment_mach_decay)) *
                               (p->moment_alpha_squared * alpha2 + p->moment_alpha * alpha + p->moment_zero);
    const real damping = (p->damping_mach * mach + p->damping_mach_zero) *
                         (p->damping_alpha_squared * alpha2 + p->damping_alpha * alpha + p->damping_zero);
    const real lean = (1.0 + p->thrust_fuel) * fuel, rich = 1.0 + p->thrust_fuel * fuel;
    const mask is_rich = real_part(fuel) > 1.0;
    Forces f;
    f.pressure = pressure;
    f.lift = force *
             (alpha * (p->lift_alpha + p->lift_alpha_mach / mach) +
              (p->lift_elevator_alpha_squared * alpha2 + p->lift_elevator_alpha * alpha + p->lift_elevator) * elevator);
    f.drag = force * (p->drag_scale * (p->drag_alpha_squared * alpha2 + p->drag_alpha * alpha + 1.0) *
                      (p->drag_mach_squared * mach * mach + p->drag_mach * mach + 1.0));
    f.thrust = force * (p->thrust_scale * (1.0 + p->thrust_mach / mach) * select_real(is_rich, rich, lean));
    f.moment = force * p->mean_aerodynamic_chord *
               (static_moment + p->moment_elevator * (elevator - alpha) +
                0.5 * p->mean_aerodynamic_chord * rate / velocity * damping);
    return f;
}

/* Return the acceleration of gravity (m/s^2) and write its centrifugal relief (m/s^2). */
static inline real winged_cone_gravity(real altitude, real velocity, const Vehicle *p, real *relief)
{
    const real radius = p->planet_radius + altitude;
    *relief = velocity * velocity / radius;
    return p->gravitational_parameter / (radius * radius);
}

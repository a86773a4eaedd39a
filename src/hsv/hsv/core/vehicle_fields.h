/* Constants of the equations of motion, SI, in the order of hsv.model.dynamics.VehicleParameters. */
number mass, moment_of_inertia, gravity, reference_area, mean_aerodynamic_chord, thrust_moment_arm;
number reference_density, reference_altitude, density_scale_height;
number lift_alpha, lift_elevator, lift_zero;
number drag_alpha_squared, drag_alpha, drag_elevator_squared, drag_elevator, drag_zero;
number moment_alpha_squared, moment_alpha, moment_zero, moment_elevator;
number thrust_beta_1, thrust_beta_2, thrust_beta_3, thrust_beta_4;
number thrust_beta_5, thrust_beta_6, thrust_beta_7, thrust_beta_8;
number elastic_force_1_alpha_squared, elastic_force_1_alpha, elastic_force_1_zero;
number elastic_force_2_alpha_squared, elastic_force_2_alpha, elastic_force_2_elevator, elastic_force_2_zero;
number damping_ratio_1, damping_ratio_2, natural_frequency_1, natural_frequency_2;
/* Chosen inertial coupling, and limits */
number inertial_coupling_1, inertial_coupling_2;
number fuel_equivalence_ratio_minimum, fuel_equivalence_ratio_maximum;
number elevator_deflection_minimum, elevator_deflection_maximum, angle_limit;
/* Constants of the Winged-Cone only */
number gravitational_parameter, planet_radius, sound_speed_curvature, sound_speed_slope, sound_speed_zero;
number lift_alpha_mach, lift_elevator_alpha_squared, lift_elevator_alpha, drag_scale, drag_mach_squared, drag_mach,
    thrust_scale, thrust_mach, thrust_fuel;
number moment_scale, moment_mach, moment_mach_decay;
number damping_mach, damping_mach_zero, damping_alpha_squared, damping_alpha, damping_zero;
/* The number of the structure */
number structure;

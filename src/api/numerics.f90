!> Re-exports the library's numerical procedures, so that one `use` suffices for programs that build machines in code or solve their
!> own systems. doc/library.md describes the procedures.
module gestell_api_numerics
  use gestell_base_verdict, only: verdict_failed => failed_number, verdict_impossible => impossible_number, &
    & verdict_stable => stable_number, verdict_type, verdict_undamped => undamped_number, &
    & verdict_undecided => undecided_number, verdict_unstable => unstable_number
  use gestell_base_error, only: error_type, failed_computation, impossible_mechanism, invalid_input, wrong_usage
  use gestell_math_series_fourier, only: fourier_series, fourier_type
  use gestell_math_jet, only: cos, jet, operator(*), operator(+), operator(-), operator(/), sin, sqrt
  use gestell_base_kinds, only: dp, pi
  use gestell_base_version, only: version
  use gestell_floquet_period_period_map, only: period_map, trajectory
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_choice_methods, only: method_names, new_method
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution_part, only: solution_methods
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: evidence, evidence_type, floquet_type, follow, liouville_defect, solve_floquet, &
    & solve_multipliers, solve_periodic
  use gestell_model_linkage_bodies, only: link_type
  use gestell_model_linkage_diagnosis, only: diagnose, diagnosis_type
  use gestell_model_quantity_driving, only: damper_watts, drive_power, drive_watts, power_rows, rigid_torque, stored_energy, torque
  use gestell_model_frame, only: frame_type, dof_names, new_frame, add_gravity
  use gestell_model_mechanism_shaking, only: shaking, shaking_type
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: form_type, itself, joint_type, point_type, reach_type
  use gestell_model_joints_path, only: batch, path_type
  use gestell_model_joints_placement, only: placement_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_v, a2_d, a2_dd, a2_v, a3_d, a3_dd, a3_v, a4_v, mass_functions_type, &
    & mechanism_type, table_columns
  use gestell_model_mounting, only: damping_matrix, stiffness_matrix, support_type
  use gestell_model_quantity, only: find_quantity, point_quantity
  use gestell_model_quantity_rows, only: accelerations, displacements, guide_forces, probe_type, quantity_type, velocities
  use gestell_model_frame_in_space, only: split_into_planes, put_in_space
  use gestell_model_space_masses, only: plane_type
  use gestell_study_vibration_analysis, only: analyse, analysis_options, analysis_type
  use gestell_task_boundary_line_borders, only: border_accuracy, border_rest_type, border_type, find_borders, &
    & nearest_stable, nearest_type, open_border_type
  use gestell_task_boundary_map, only: border_map_type, border_vertex_type, trace_borders
  use gestell_task_campbell, only: campbell_options, campbell_point_type, campbell_type, solve_campbell
  use gestell_task_campbell_crossings, only: crossing_type, find_crossings
  use gestell_task_critical, only: critical_type, find_critical
  use gestell_task_power_drive, only: drive_type, find_drive, torque_type
  use gestell_system_family, only: family_type
  use gestell_study_frame_model, only: frame_models, newton_type, settle, settle_member
  use gestell_study_frame_model_settled_family, only: settled_family_type
  use gestell_study_grid, only: axis_type, grid_type, new_axis, new_grid, tile_type
  use gestell_task_forces_reactions, only: along_x, along_y, along_z, find_reactions, moment, moment_x, moment_y, &
    & reaction_type, static_force, force_magnitude
  use gestell_study_measure, only: band_measure, measure_type, new_measure, peak_measure, rms_measure, compute_measures
  use gestell_study_mode_solution, only: solve_modes
  use gestell_study_mode, only: mode_type
  use gestell_study_point, only: solve_point, sweep_options
  use gestell_task_sweep, only: solve_tile
  use gestell_task_resonance_curve, only: resonance_curve_type, solve_curve, start_curve
  use gestell_task_resonance_maxima, only: maximum_type
  use gestell_task_sensitivity, only: sensitivity_base_type, sensitivity_type, solve_base, solve_parameter, solve_sensitivity
  use gestell_study_speed_point, only: solve_speed_point, speed_options, speed_point_type
  use gestell_study_vibration_vibration_list, only: index_sum, list_vibrations, search_vibrations, listed_vibration_type
  use gestell_study_vibration_statistics, only: band_rms, history_of, statistics_type, compute_statistics
  use gestell_study_mechanism_cache, only: cache_mechanism
  use gestell_study_tile_results, only: column_eta_peak => eta_peak, column_log_rho_max => log_rho_max, &
    & column_psi_peak => psi_peak, column_rho_error => rho_error, column_rho_max => rho_max, column_verdict => verdict, &
    & column_xi_peak => xi_peak, sweep_columns, tile_results_type
  use gestell_task_trade, only: cheapest, measure_trade, trade_row_type, trade_type
  use gestell_study_vibration, only: solve_vibration, vibration_type
  use gestell_task_probes_response, only: probe_part_names, probe_parts, find_responses, probe_response_type
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  public
end module gestell_api_numerics

!> `fpm test` runs the tests that are not slow; `fpm test -- slow` runs the slow ones; `fpm test -- all` runs both; `fpm test --
!> SUITE [TEST]` runs one suite or one test. With GESTELL_TRAPS in the environment the program stops when the processor
!> overflows, divides by zero or produces a NaN.
program main
  use slow_tests, only: is_slow, long
  use test_assembly, only: collect_assembly
  use test_averaged, only: collect_averaged
  use test_support_axes, only: collect_support_axes
  use test_balance, only: collect_balance
  use test_balance_single, only: collect_balance_single
  use test_base, only: collect_base
  use test_bounds, only: collect_bounds
  use test_boundary, only: collect_boundary
  use test_boundary_level, only: collect_boundary_level
  use test_boundary_machines, only: collect_boundary_machines
  use test_boundary_map, only: collect_boundary_map
  use test_boundary_tongues, only: collect_boundary_tongues
  use test_callbacks, only: collect_callbacks
  use test_cam_laws, only: collect_cam_laws
  use test_campaign, only: collect_campaign
  use test_campbell, only: collect_campbell
  use test_campbell_critical, only: collect_campbell_critical
  use test_campbell_exponents, only: collect_campbell_exponents
  use test_campbell_modes, only: collect_campbell_modes
  use test_campbell_tracking, only: collect_campbell_tracking
  use test_method_choice, only: collect_method_choice
  use test_chains, only: collect_chains
  use test_checks, only: collect_checks
  use test_climb, only: collect_climb
  use test_composition, only: collect_composition
  use test_cost, only: collect_cost
  use test_cylinder, only: collect_cylinder
  use test_data, only: collect_data
  use test_digits, only: collect_digits
  use test_discs, only: collect_discs
  use test_dofs, only: collect_dofs
  use test_animation, only: collect_animation
  use test_api, only: collect_api
  use test_drive, only: collect_drive
  use test_exact, only: collect_exact
  use test_exact_check, only: collect_exact_check
  use test_exact_paths, only: collect_exact_paths
  use test_equivalence, only: collect_equivalence
  use test_exchange, only: collect_exchange
  use test_factors, only: collect_factors
  use test_floquet, only: collect_floquet
  use test_follower, only: collect_follower
  use test_forces, only: collect_forces
  use test_forces_limits, only: collect_forces_limits
  use test_joint_forces, only: collect_joint_forces
  use test_ground, only: collect_ground
  use test_safeguards, only: collect_safeguards
  use test_held_speed, only: collect_held_speed
  use test_loads, only: collect_loads
  use test_hill, only: collect_hill
  use test_invalid_arguments, only: collect_invalid_arguments
  use test_html, only: collect_html
  use test_invariants, only: collect_invariants
  use test_joints, only: collect_joints
  use test_shaking, only: collect_shaking
  use test_keys, only: collect_keys
  use test_lane_numerics, only: collect_lane_numerics
  use test_lane_versions, only: collect_lane_versions
  use test_lanes, only: collect_lanes
  use test_unreliable, only: collect_unreliable
  use test_masses, only: collect_masses
  use test_mesh, only: collect_mesh
  use test_integration, only: collect_integration
  use test_methods, only: collect_methods
  use test_model, only: collect_model
  use test_model_trade, only: collect_model_trade
  use test_namelist, only: collect_namelist
  use test_namelist_errors, only: collect_namelist_errors
  use test_namelist_fuzz, only: collect_namelist_fuzz
  use test_gmres, only: collect_gmres
  use test_balanced_motion, only: collect_balanced_motion
  use test_response_bound, only: collect_response_bound
  use test_newton, only: collect_newton
  use test_convergence, only: collect_convergence
  use test_oracle, only: collect_oracle
  use test_edited_input, only: collect_edited_input
  use test_embedded_methods, only: collect_embedded_methods
  use test_decoupling, only: collect_decoupling
  use test_period_parts, only: collect_period_parts
  use test_periodic, only: collect_periodic
  use test_periodic_bounds, only: collect_periodic_bounds
  use test_periodic_schur, only: collect_periodic_schur
  use test_phasewise, only: collect_phasewise
  use test_population, only: collect_population
  use test_prediction, only: collect_prediction
  use test_motion_bounds, only: collect_motion_bounds
  use test_regions, only: collect_regions
  use test_reduction, only: collect_reduction
  use test_reduction_equations, only: collect_reduction_equations
  use test_resonance, only: collect_resonance
  use test_probes, only: collect_probes
  use test_resonance_curve, only: collect_resonance_curve
  use test_math, only: collect_math
  use test_minimax, only: collect_minimax
  use test_quadratic_program, only: collect_quadratic_program
  use test_history_rows, only: collect_history_rows
  use test_design, only: collect_design
  use test_design_gradients, only: collect_design_gradients
  use test_sensitivity, only: collect_sensitivity
  use test_separation, only: collect_separation
  use test_set_option, only: collect_set_option
  use test_spectra, only: collect_spectra
  use test_spectra_edges, only: collect_spectra_edges
  use test_shared_tables, only: collect_shared_tables
  use test_peaks, only: collect_peaks
  use test_sweep, only: collect_sweep
  use test_tabulate, only: collect_tabulate
  use test_text_table, only: collect_text_table
  use test_trade, only: collect_trade
  use test_small_motions, only: collect_small_motions
  use test_space, only: collect_space
  use test_space_held_speed, only: collect_space_held_speed
  use test_weights, only: collect_weights
  use test_undamped, only: collect_undamped
  use test_user_joint, only: collect_user_joint
  use test_version, only: collect_version
  use test_vibration, only: collect_vibration
  use testdrive, only: get_argument, new_testsuite, run_selected, testsuite_type, unittest_type
  use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_halting_mode, ieee_usual
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  implicit none (type, external)

  type(testsuite_type), allocatable :: suites(:)
  type(unittest_type), allocatable :: tests(:)
  character(len=:), allocatable :: suite_name, test_name
  integer :: i, k, failed, no_traps, slow, total
  logical :: halting(3), one_suite
  real :: begin, finish

  suites = [ &
    & new_testsuite("animation", collect_animation), &
    & new_testsuite("base", collect_base), &
    & new_testsuite("chains", collect_chains), &
    & new_testsuite("checks", collect_checks), &
    & new_testsuite("composition", collect_composition), &
    & new_testsuite("cost", collect_cost), &
    & new_testsuite("mesh", collect_mesh), &
    & new_testsuite("html", collect_html), &
    & new_testsuite("text-table", collect_text_table), &
    & new_testsuite("integration", collect_integration), &
    & new_testsuite("methods", collect_methods), &
    & new_testsuite("method-choice", collect_method_choice), &
    & new_testsuite("bounds", collect_bounds), &
    & new_testsuite("floquet", collect_floquet), &
    & new_testsuite("periodic", collect_periodic), &
    & new_testsuite("convergence", collect_convergence), &
    & new_testsuite("embedded-methods", collect_embedded_methods), &
    & new_testsuite("decoupling", collect_decoupling), &
    & new_testsuite("factors", collect_factors), &
    & new_testsuite("schur", collect_periodic_schur), &
    & new_testsuite("schur-bounds", collect_periodic_bounds), &
    & new_testsuite("regions", collect_regions), &
    & new_testsuite("gmres", collect_gmres), &
    & new_testsuite("reduction", collect_reduction), &
    & new_testsuite("reduction-equations", collect_reduction_equations), &
    & new_testsuite("phasewise", collect_phasewise), &
    & new_testsuite("model", collect_model), &
    & new_testsuite("ground", collect_ground), &
    & new_testsuite("safeguards", collect_safeguards), &
    & new_testsuite("invalid-arguments", collect_invalid_arguments), &
    & new_testsuite("unreliable-results", collect_unreliable), &
    & new_testsuite("math", collect_math), &
    & new_testsuite("minimax", collect_minimax), &
    & new_testsuite("quadratic-program", collect_quadratic_program), &
    & new_testsuite("lanes", collect_lanes), &
    & new_testsuite("lane_versions", collect_lane_versions), &
    & new_testsuite("lane_numerics", collect_lane_numerics), &
    & new_testsuite("spectra", collect_spectra), &
    & new_testsuite("discs", collect_discs), &
    & new_testsuite("spectra-edges", collect_spectra_edges), &
    & new_testsuite("shared-tables", collect_shared_tables), &
    & new_testsuite("masses", collect_masses), &
    & new_testsuite("tabulate", collect_tabulate), &
    & new_testsuite("assembly", collect_assembly), &
    & new_testsuite("keys", collect_keys), &
    & new_testsuite("joints", collect_joints), &
    & new_testsuite("shaking", collect_shaking), &
    & new_testsuite("cam_laws", collect_cam_laws), &
    & new_testsuite("follower", collect_follower), &
    & new_testsuite("cylinder", collect_cylinder), &
    & new_testsuite("undamped", collect_undamped), &
    & new_testsuite("user-joint", collect_user_joint), &
    & new_testsuite("motion-bounds", collect_motion_bounds), &
    & new_testsuite("equivalence", collect_equivalence), &
    & new_testsuite("data", collect_data), &
    & new_testsuite("hill", collect_hill), &
    & new_testsuite("invariants", collect_invariants), &
    & new_testsuite("population", collect_population), &
    & new_testsuite("oracle", collect_oracle), &
    & new_testsuite("prediction", collect_prediction), &
    & new_testsuite("vibration", collect_vibration), &
    & new_testsuite("forces", collect_forces), &
    & new_testsuite("forces-limits", collect_forces_limits), &
    & new_testsuite("joint-forces", collect_joint_forces), &
    & new_testsuite("probes", collect_probes), &
    & new_testsuite("digits", collect_digits), &
    & new_testsuite("dofs", collect_dofs), &
    & new_testsuite("api", collect_api), &
    & new_testsuite("drive", collect_drive), &
    & new_testsuite("exact", collect_exact), &
    & new_testsuite("exact_check", collect_exact_check), &
    & new_testsuite("exact_paths", collect_exact_paths), &
    & new_testsuite("newton", collect_newton), &
    & new_testsuite("balanced-motion", collect_balanced_motion), &
    & new_testsuite("response-bound", collect_response_bound), &
    & new_testsuite("support-axes", collect_support_axes), &
    & new_testsuite("balance", collect_balance), &
    & new_testsuite("balance-single", collect_balance_single), &
    & new_testsuite("held-speed", collect_held_speed), &
    & new_testsuite("loads", collect_loads), &
    & new_testsuite("trade", collect_trade), &
    & new_testsuite("averaged", collect_averaged), &
    & new_testsuite("model-trade", collect_model_trade), &
    & new_testsuite("history-rows", collect_history_rows), &
    & new_testsuite("resonance", collect_resonance), &
    & new_testsuite("modes", collect_campbell_modes), &
    & new_testsuite("exponents", collect_campbell_exponents), &
    & new_testsuite("campbell", collect_campbell), &
    & new_testsuite("tracking", collect_campbell_tracking), &
    & new_testsuite("critical", collect_campbell_critical), &
    & new_testsuite("resonance-curve", collect_resonance_curve), &
    & new_testsuite("design", collect_design), &
    & new_testsuite("climb", collect_climb), &
    & new_testsuite("design-gradients", collect_design_gradients), &
    & new_testsuite("sensitivity", collect_sensitivity), &
    & new_testsuite("separation", collect_separation), &
    & new_testsuite("sweep", collect_sweep), &
    & new_testsuite("period_parts", collect_period_parts), &
    & new_testsuite("callbacks", collect_callbacks), &
    & new_testsuite("campaign", collect_campaign), &
    & new_testsuite("peaks", collect_peaks), &
    & new_testsuite("boundary", collect_boundary), &
    & new_testsuite("boundary-level", collect_boundary_level), &
    & new_testsuite("boundary-machines", collect_boundary_machines), &
    & new_testsuite("boundary-map", collect_boundary_map), &
    & new_testsuite("boundary-tongues", collect_boundary_tongues), &
    & new_testsuite("exchange", collect_exchange), &
    & new_testsuite("version", collect_version), &
    & new_testsuite("space", collect_space), &
    & new_testsuite("space-held-speed", collect_space_held_speed), &
    & new_testsuite("small_motions", collect_small_motions), &
    & new_testsuite("weights", collect_weights), &
    & new_testsuite("namelist", collect_namelist), &
    & new_testsuite("edited-input", collect_edited_input), &
    & new_testsuite("namelist-errors", collect_namelist_errors), &
    & new_testsuite("namelist-fuzz", collect_namelist_fuzz), &
    & new_testsuite("set-option", collect_set_option)]

  failed = 0
  total = 0
  slow = 0
  call get_environment_variable("GESTELL_TRAPS", status=no_traps)
  if (no_traps == 0) call ieee_set_halting_mode(ieee_usual, .true.)
  call ieee_get_halting_mode(ieee_usual, halting)
  call get_argument(1, suite_name)
  call get_argument(2, test_name)
  if (.not. allocated(suite_name)) suite_name = ""
  one_suite = all(suite_name /= [character(len=4) :: "", "slow", "all"])
  if (one_suite) then
    if (.not. any([(suites(i)%name == suite_name, i = 1, size(suites))])) then
      write (error_unit, "(a)") "there is no suite '" // suite_name // "'; besides 'all' and 'slow' there are"
      write (error_unit, "(2x, a)") (suites(i)%name, i = 1, size(suites))
      error stop 1, quiet=.true.
    end if
  end if
  do i = 1, size(suites)
    if (one_suite .and. suites(i)%name /= suite_name) cycle
    write (error_unit, "(a)") "# " // suites(i)%name
    if (allocated(test_name)) then
      call run_selected(suites(i)%collect, test_name, error_unit, failed)
      total = total + 1
      ! An unknown test: run_selected has listed the tests of its suite.
      if (failed < 0) failed = 1
    else
      call suites(i)%collect(tests)
      ! Tests run one after the other, because the reader of input files is not thread-safe, and to keep random numbers the same.
      do k = 1, size(tests)
        if (merge(suite_name == "", suite_name == "slow", is_slow(tests(k)))) cycle
        write (error_unit, "(2x, a)") "Starting " // tests(k)%name
        call cpu_time(begin)
        call run_selected(suites(i)%collect, tests(k)%name, error_unit, failed)
        call cpu_time(finish)
        if (finish - begin > long .and. .not. is_slow(tests(k))) then
          write (error_unit, "(7x, f0.1, a)") finish - begin, " s of processor time: mark this test as slow"
        end if
        total = total + 1
      end do
      slow = slow + count([(is_slow(tests(k)), k = 1, size(tests))])
    end if
    ! A suite may have changed the traps.
    call ieee_set_halting_mode(ieee_usual, halting)
  end do
  if (suite_name == "") write (error_unit, "(i0, a)") slow, " slow tests were skipped; to run them: fpm test -- all"
  flush (error_unit)
  write (output_unit, "(i0, a, i0, a)") total - failed, " passed, ", failed, " failed"
  if (failed > 0 .or. total == 0) error stop 1, quiet=.true.
end program main

!> The task `forces`: computes the forces that the supports, the foundation and the guides exert on the ground.
module gestell_task_forces
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: either, text
  use gestell_model_frame, only: frame_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_harmonics, add_order_column, add_orders, add_turn
  use gestell_output_table_unit, only: degree, metre, newton, newton_metre, plain, unit_type
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_forces_reactions, only: find_reactions, has_component, component_count, component_names, components_of, &
    & reaction_type, support_positions, force_magnitude
  use gestell_task_forces_plot, only: plot_histories, plot_orders, plot_summary
  use gestell_task_forces_report, only: force_lines
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  type, extends(task_type), public :: forces_task
  contains
    procedure :: describe, read => read_forces, run
  end type forces_task

  type(unit_type), parameter :: units(component_count) = [newton, newton, newton, newton_metre, newton, newton_metre, newton_metre]

contains

  pure subroutine describe(self)
    class(forces_task), intent(inout) :: self

    self%name = "forces"
    self%meaning = "force that each support exerts on the ground"
    self%tables = [character(len=longest_table) :: "supports", "supports_history", "supports_harmonics"]
    self%gives_verdict = .true.
    self%brief = .true.
  end subroutine describe

  !> If the task is requested, includes the rows of the motion that it needs (velocities, forces of guides) in the results to
  !> compute.
  subroutine read_forces(self, configuration, error)
    class(forces_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    if (self%requested) configuration%analysis%rows = max(configuration%analysis%rows, configuration%force_rows())
  end subroutine read_forces

  !> Computes the forces on the ground, and adds tables, pictures and report to `result`.
  subroutine run(self, context, result, error)
    class(forces_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(reaction_type), allocatable :: reactions(:)
    type(table_type) :: table, histories, harmonics
    type(error_type), allocatable :: failure
    character(len=:), allocatable :: turn, column
    integer, allocatable :: parts(:)
    real(dp) :: peak
    integer :: i, k

    associate (frame => context%configuration%frame, last => context%configuration%analysis%harmonics, unused => self)
      if (allocated(context%analysis%vibration)) call find_reactions(context%analysis%frame, context%analysis%vibration, &
        & reactions, failure, context%executor)
      if (allocated(reactions)) then
        if (.not. all([(all(reactions(i)%statistics%finite()) .and. all(ieee_is_finite(reactions(i)%history)) &
          & .and. ieee_is_finite(reactions(i)%least_compression), i = 1, size(reactions))])) then
          deallocate(reactions)
          call fatal_error(failure, "the forces on the ground overflow double precision", failed_computation)
        end if
      end if
      peak = ieee_value(peak, ieee_quiet_nan)
      if (allocated(reactions)) peak = reactions(size(reactions))%statistics(force_magnitude)%peak
      call result%brief%expect(1 + size(support_positions(frame), 2))
      call result%brief%add("f_peak", newton, "peak magnitude of the total force on the ground", [peak])
      do i = 1, size(support_positions(frame), 2)
        if (allocated(reactions)) peak = reactions(i)%statistics(force_magnitude)%peak
        call result%brief%add("support(" // text(i) // ").f_peak", newton, "peak magnitude of the force that the support " &
          & // "exerts on the ground", [peak])
      end do
      call result%record_failure(failure)
      if (.not. allocated(reactions)) return
      table = summary(reactions, frame)
      call table%convert(result%units)
      call result%add(table)
      turn = turns_in_words(frame%mechanism%turns)
      histories = new_table("supports_history", "Forces over " // turn, "Forces that the supports exert on the ground during " &
        & // turn // ".")
      call add_turn(histories, frame, size(reactions(1)%history, 1) - 1)
      call histories%expect(sum([(size(components_of(reactions(i))), i = 1, size(reactions))]))
      harmonics = new_table("supports_harmonics", "Forces by orders", &
        & "Amplitudes of the forces that the supports exert on the ground, for each order of the crank speed.")
      call add_orders(harmonics, frame, last)
      ! Each component has two columns: amplitude and phase.
      call harmonics%expect(2 * sum([(count(components_of(reactions(i)) /= force_magnitude), i = 1, size(reactions))]))
      do i = 1, size(reactions)
        parts = components_of(reactions(i))
        do k = 1, size(parts)
          column = trim(component_names(parts(k))) // "_" // trim(reactions(i)%name)
          associate (unit => units(parts(k)))
            call histories%add(column, unit, "force or moment on the ground", reactions(i)%history(:, parts(k)))
            if (parts(k) /= force_magnitude) call add_harmonics(harmonics, column, unit, &
              & reactions(i)%statistics(parts(k))%series(1), last)
          end associate
        end do
      end do
      call histories%convert(result%units)
      call harmonics%convert(result%units)
      call result%add(histories)
      call result%add(harmonics)
      if (context%is_presented()) then
        call result%add_figure(plot_summary(table, reactions))
        call result%add_figure(plot_histories(histories, reactions, frame))
        call result%add_figure(plot_orders(harmonics, reactions, frame%mechanism%turns))
      end if
      if (.not. context%reports) return
      call result%write_section("FORCES ON THE GROUND " // either("due to the motion", "without weight", &
        & any(reactions%includes_weight)) // "; f: magnitude; %: share of rms^2", force_lines(reactions, frame))
    end associate
  end subroutine run

  !> The table supports.csv, which has one row for each support, for the foundation, for the guides and for the total.
  pure type(table_type) function summary(reactions, frame) result(table)
    type(reaction_type), intent(in) :: reactions(:)
    class(frame_type), intent(in) :: frame
    !> Columns: peak, its error bound, rms, crest factor, and crank angle of the peak
    real(dp) :: values(size(reactions), 5)
    character, parameter :: axes(3) = ["x", "y", "z"]
    character(len=:), allocatable :: part
    integer :: orders(size(reactions)), i, k, n
    integer, allocatable :: parts(:)

    table = new_table("supports", "Forces on the ground", "Peak and root mean square of the force that each support exerts on " &
      & // "the ground.", shown=.true.)
    call table%add("support", "number of the support; 'foundation'; 'guide': guides of the locked degrees of freedom; 'total': " &
      & // "sum of all these forces", (reactions%name))
    do k = 1, size(reactions(1)%position)
      call table%add(axes(k), metre, "coordinate in the frame's axes", [(reactions(i)%position(k), i = 1, size(reactions))])
    end do
    ! the total, which is the last element, has all components
    parts = components_of(reactions(size(reactions)))
    do n = 1, size(parts)
      k = parts(n)
      values = 0
      do i = 1, size(reactions)
        if (.not. has_component(reactions(i), k)) cycle
        associate (found => reactions(i)%statistics(k))
          values(i, :) = [found%peak, found%peak_error, found%rms, found%crest(), frame%degrees_per_period() * found%peak_phase]
        end associate
      end do
      part = trim(component_names(k))
      call table%add(part // "_peak", units(k), "largest absolute value over the period", values(:, 1), bounds=values(:, 2))
      call table%add(part // "_rms", units(k), "root mean square over the period", values(:, 3))
      call table%add(part // "_crest", plain, "crest factor, peak / rms; 0 if the rms is 0", values(:, 4))
      call table%add(part // "_peak_crank", degree, "crank angle at which the peak occurs", values(:, 5))
    end do
    do n = 1, size(parts)
      orders = 0
      do i = 1, size(reactions)
        if (has_component(reactions(i), parts(n))) orders(i) = reactions(i)%statistics(parts(n))%strongest()
      end do
      call add_order_column(table, trim(component_names(parts(n))) // "_strongest_order", &
        & "order of the crank speed with the largest amplitude; 0: all amplitudes are zero", orders, frame%mechanism%turns)
    end do
    call table%mark_details([character(len=15) :: "x_m", "y_m", "z_m", "crest", "peak_crank", "strongest_order"])
    if (.not. any(reactions%includes_weight)) return
    do k = 1, size(reactions(1)%position)
      call table%add("static_f" // axes(k), newton, "static force along " // axes(k), &
        & [(reactions(i)%static(k), i = 1, size(reactions))])
    end do
    call table%add("least_compression", newton, "minimum over the period of the force along gravity, including the static force", &
      & (reactions%least_compression), bounds=(reactions%min_error))
  end function summary

end module gestell_task_forces

!> The task `response`: computes the periodic vibration of the frame.
module gestell_task_response
  use gestell_base_error, only: error_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_result_units, only: conversion_type
  use gestell_output_table_turn, only: add_harmonics, add_orders, add_turn
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_response_names, only: name_type, names_of
  use gestell_task_response_plot, only: plot_harmonics, plot_response
  use gestell_output_picture_script, only: figure_type
  use gestell_task_response_shaking_plot, only: plot_force_polar, plot_transmissibility, sample_shaking
  use gestell_task_response_report, only: closing_lines, vibration_lines
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> The part of the task `response` that computes the vibration of the frame as a whole.
  type, extends(task_type), public :: response_task
  contains
    procedure :: describe, read => read_response, run
  end type response_task

contains

  pure subroutine describe(self)
    class(response_task), intent(inout) :: self

    self%name = "response"
    self%meaning = "periodic vibration of the frame and the probes"
    self%tables = [character(len=longest_table) :: "response", "harmonics", "force_polar", "transmissibility"]
    self%gives_verdict = .true.
    self%brief = .true.
  end subroutine describe

  !> If the task is requested, includes the periodic vibration in the results to compute.
  subroutine read_response(self, configuration, error)
    class(response_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    configuration%analysis%response = self%requested
  end subroutine read_response

  !> Adds tables, pictures and report of the periodic vibration to `result`.
  subroutine run(self, context, result, error)
    class(response_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(name_type) :: names(3 * context%configuration%frame%dofs())
    type(table_type) :: history, harmonics
    type(figure_type) :: figure
    type(figure_type), allocatable :: figures(:)
    type(conversion_type) :: conversion
    real(dp), allocatable :: loads(:, :)
    real(dp) :: peak
    integer :: k

    names = names_of(context%configuration%frame%dofs())
    associate (frame => context%configuration%frame, tasks => context%configuration%analysis, unused => self)
      if (allocated(context%analysis%vibration)) then
        associate (vibration => context%analysis%vibration)
          history = new_table("response", "Vibration over " // turns_in_words(frame%mechanism%turns), &
            & "Displacements of the frame and forces on the ground over the period. The table also contains the velocities.")
          call add_turn(history, frame, size(vibration%history, 2) - 1)
          harmonics = new_table("harmonics", "Spectrum", "Amplitudes for each order of the crank. " &
            & // "The table also contains the phases.")
          call add_orders(harmonics, frame, tasks%harmonics)
          do k = 1, size(names)
            call history%add(trim(names(k)%column), names(k)%unit, trim(names(k)%meaning), vibration%history(k, :))
            call add_harmonics(harmonics, trim(names(k)%column), names(k)%unit, vibration%series(k), tasks%harmonics)
          end do
          if (frame%dofs() > 3) then
            call name_axis_of_moment(history)
            call name_axis_of_moment(harmonics)
          end if
          call history%convert(result%units)
          call harmonics%convert(result%units)
          call result%add(history)
          call result%add(harmonics)
          if (context%is_presented()) then
            call result%add_figure(plot_response(history, frame, vibration))
            call result%add_figure(plot_harmonics(harmonics, frame))
            call sample_shaking(frame, loads)
            if (size(loads) > 0) then
              do k = 1, frame%dofs()
                conversion = result%units%conversion(names(2 * frame%dofs() + k)%unit%words)
                loads(k, :) = conversion%converted(loads(k, :))
              end do
            end if
            figure = plot_force_polar(history, frame, loads)
            call result%add_figure(figure)
            figures = plot_transmissibility(harmonics, frame, loads)
            do k = 1, size(figures)
              call result%add_figure(figures(k))
            end do
          end if
          if (context%reports) then
            call result%write_section("PERIODIC VIBRATION", vibration_lines(vibration, frame))
            call result%detail(closing_lines(vibration, frame%mechanism%turns, tasks%averaged))
          end if
        end associate
      end if
      do k = 1, frame%dofs()
        peak = ieee_value(peak, ieee_quiet_nan)
        if (allocated(context%analysis%vibration)) peak = context%analysis%vibration%peak(k)
        call result%brief%add(trim(names(k)%column) // "_peak", names(k)%unit, "peak of the vibration", [peak])
      end do
    end associate
  end subroutine run

  !> Calls the moment about z "mz" for readers of a table in space, where the key of its column is m as in the plane.
  pure subroutine name_axis_of_moment(table)
    type(table_type), intent(inout) :: table
    integer :: k

    do k = 1, size(table%columns)
      if (index(table%columns(k)%label // " ", "m ") == 1) table%columns(k)%label = "mz" // table%columns(k)%label(2:)
    end do
  end subroutine name_axis_of_moment

end module gestell_task_response

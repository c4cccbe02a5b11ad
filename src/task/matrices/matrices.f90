!> The task `matrices`: writes the coefficients of the linear equations of motion over the period, for use in other programs.
module gestell_task_matrices
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: newline
  use gestell_model_frame, only: dof_names
  use gestell_model_mounting, only: is_rotation
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_turn
  use gestell_output_table_unit, only: kilogram_metre, newton, newton_metre, unit_type
  use gestell_system_averaged, only: averaged_system
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  implicit none (type, external)
  private

  type, extends(task_type), public :: matrices_task
  contains
    procedure :: describe, read => read_matrices, run
  end type matrices_task

  !> Names of the matrices, and units of their elements between two displacements, a displacement and a rotation, and two rotations
  character, parameter :: names(3) = ["m", "b", "c"]
  type(unit_type), parameter :: units(0:2, 3) = reshape([ &
    & unit_type("kg", "kg"), kilogram_metre, unit_type("kg_m2", "kg m^2"), &
    & unit_type("Ns_m", "N s/m"), unit_type("Ns", "N s"), unit_type("Nms", "N m s"), &
    & unit_type("N_m", "N/m"), newton, newton_metre], [3, 3])

contains

  pure subroutine describe(self)
    class(matrices_task), intent(inout) :: self

    self%name = "matrices"
    self%meaning = "coefficients M, B, C and load h of the linear equations of motion over one period, for other programs"
    self%tables = [character(len=longest_table) :: "matrices"]
    self%gives_verdict = .true.
  end subroutine describe

  !> If the task is requested, includes the verdict in the results to compute.
  subroutine read_matrices(self, configuration, error)
    class(matrices_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    configuration%analysis%verdict = configuration%analysis%verdict .or. self%requested
  end subroutine read_matrices

  !> Adds the table of the coefficients of M q'' + B q' + C q = h to `result`. They are those of the equations that the program
  !> solves: linearised about rest or about the vibration, or averaged.
  subroutine run(self, context, result, error)
    class(matrices_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(averaged_system) :: means
    type(table_type) :: table
    real(dp), allocatable :: phases(:), a(:, :, :, :), h(:, :)
    integer :: points, n, i, k, j

    associate (frame => context%analysis%frame, options => context%configuration%analysis, unused => self)
      points = options%points
      n = size(frame%free)
      phases = [(real(k, dp) / points, k = 0, points)]
      allocate(a(points + 1, n, n, 3), h(points + 1, n))
      if (options%averaged) then
        call frame%averaged(means)
        call means%sample_second_order(phases, a(:, :, :, 1), a(:, :, :, 2), a(:, :, :, 3), h)
      else
        call frame%sample_second_order(phases, a(:, :, :, 1), a(:, :, :, 2), a(:, :, :, 3), h)
      end if
      table = new_table("matrices", "Equations of motion", "Coefficients of M q'' + B q' + C q = h over " &
        & // turns_in_words(frame%mechanism%turns) // ".")
      table%always_si = .true.
      table%remarks = "M q'' + B q' + C q = h with q ="
      do i = 1, n
        table%remarks = table%remarks // " " // trim(dof_names(frame%free(i)))
      end do
      table%remarks = table%remarks // newline
      call table%expect(2 + 3 * n**2 + n)
      call add_turn(table, frame, points)
      do j = 1, 3
        do i = 1, n
          do k = 1, n
            call table%add(names(j) // "_" // trim(dof_names(frame%free(i))) // "_" // trim(dof_names(frame%free(k))), &
              & units(count(is_rotation(frame%free([i, k]))), j), "element of the matrix", a(:, i, k, j))
          end do
        end do
      end do
      do i = 1, n
        call table%add("h_" // trim(dof_names(frame%free(i))), merge(newton_metre, newton, is_rotation(frame%free(i))), &
          & "element of the load", h(:, i))
      end do
      call result%add(table)
    end associate
  end subroutine run

end module gestell_task_matrices

!> The task `modes`: computes multipliers and mode shapes (eigenvectors).
module gestell_task_modes
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: judgement_type
  use gestell_output_picture_scene, only: scene_type
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: plain
  use gestell_study_vibration_analysis, only: find_modes
  use gestell_task_common_task, only: longest_table
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_modes_shapes, only: build_shapes
  use gestell_task_response_names, only: name_type, names_of
  use gestell_task_response_plot, only: speed_in_words
  use gestell_task_stability, only: stability_task
  implicit none (type, external)
  private

  type, extends(stability_task), public :: modes_task
  contains
    procedure :: describe, read => read_modes, run
  end type modes_task

contains

  pure subroutine describe(self)
    class(modes_task), intent(inout) :: self

    call self%stability_task%describe()
    self%name = "modes"
    self%meaning = "mode shapes of the free vibrations: eigenvectors of Phi(T), the state transition over one period"
    self%tables = [character(len=longest_table) :: "multipliers", "modes"]
  end subroutine describe

  !> If the task is requested, includes the eigenvectors in the results to compute.
  subroutine read_modes(self, configuration, error)
    class(modes_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    configuration%analysis%modes = self%requested
  end subroutine read_modes

  !> Adds the table modes.csv and its picture to `result`. They contain the mode shapes at crank angle 0, which are the
  !> eigenvectors of the monodromy matrix Phi(T).
  subroutine run(self, context, result, error)
    class(modes_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: vectors(:, :)
    type(name_type), allocatable :: names(:)
    type(scene_type), allocatable :: scenes(:)
    type(table_type) :: table
    character(len=:), allocatable :: shown
    integer :: dofs, f, i

    if (.not. result%has("multipliers")) call self%stability_task%run(context, result, error)
    if (allocated(error)) return
    associate (frame => context%configuration%frame, multipliers => context%analysis%multipliers)
      dofs = frame%dofs()
      f = size(frame%free)
      names = names_of(dofs)
      ! the elements of locked degrees of freedom are zero
      allocate(vectors(2 * dofs, size(multipliers%rho)), source=(0.0_dp, 0.0_dp))
      vectors(frame%free, :) = multipliers%vectors(:f, :)
      vectors(dofs + frame%free, :) = multipliers%vectors(f + 1:, :)
      table = new_table("modes", "Modes", "Shapes in which the frame vibrates freely. The table contains their " &
        & // "displacements and velocities at crank angle 0.", &
        & judgement_type(multipliers%judge()))
      call table%add("index", "number of the multiplier", [(i, i = 1, size(multipliers%rho))])
      do i = 1, 2 * dofs
        call table%add(trim(names(i)%column) // "_re", plain, "real part; the eigenvector has norm 1 in SI units", &
          & real(vectors(i, :)))
        call table%add(trim(names(i)%column) // "_im", plain, "imaginary part", aimag(vectors(i, :)))
      end do
      call result%add(table)
      if (.not. context%is_presented()) return
      call find_modes(frame, context%configuration%analysis%averaged, context%configuration%accuracy, context%analysis)
      call build_shapes(frame, context%analysis%modes, context%configuration%probes, scenes)
      shown = "Mode shapes at " // speed_in_words(frame)
      call result%draw("modes", shown, scenes)
      if (context%draws) call result%animate("modes", shown, scenes)
    end associate
  end subroutine run

end module gestell_task_modes

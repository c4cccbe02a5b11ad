!> The path of the exact frame's vibrations over one parameter.
module gestell_task_boundary_vibration_path
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_series_trigonometric, only: series_type
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame, varied_frame_type
  use gestell_system_family, only: family_type, take_member
  use gestell_study_frame_model_path, only: iterate_type, next_iterate, path_family_type
  use gestell_study_grid, only: axis_type
  use gestell_system_periodic, only: periodic_system
  use gestell_task_boundary_line, only: parameter_at
  use gestell_task_common_executor, only: executor_type, spread_over, work_type
  use gestell_task_common_record, only: record_type
  implicit none (type, external)
  private

  public :: bare_frame

  !> Machines of one parameter, lambda is u of its axis (gestell_task_boundary_line).
  type, extends(path_family_type), public :: line_path_type
    !> Gives frames that are not settled by any model.
    class(family_type), pointer :: bare => null()
    type(axis_type) :: axis
    !> Who solves, where members of the family may be asked for by several threads.
    class(executor_type), pointer :: executor => null()
  contains
    procedure :: member
    procedure :: solve_both
  end type line_path_type

  !> A piece is an iterate about q, at one of the two `ends`.
  type, extends(work_type) :: iterates_type
    type(line_path_type) :: family
    real(dp), allocatable :: q(:, :)
    real(dp) :: ends(2) = 0
    type(iterate_type) :: next(2)
  contains
    procedure :: compute
    procedure :: exchange
  end type iterates_type

contains

  subroutine member(self, lambda, varied, error)
    class(line_path_type), intent(in) :: self
    real(dp), intent(in) :: lambda
    type(varied_frame_type), intent(out) :: varied
    type(error_type), allocatable, intent(out) :: error
    class(frame_type), allocatable :: frame
    type(series_type) :: rest

    call bare_frame(self%bare, [parameter_at(self%axis, lambda)], frame, error)
    if (allocated(error)) return
    allocate(rest%cosine(0:1, frame%dofs()), rest%sine(0:1, frame%dofs()), source=0.0_dp)
    varied = varied_frame(frame, rest)
  end subroutine member

  !> The frame at these parameters. Error: it is none, or impossible.
  subroutine bare_frame(bare, parameters, frame, error)
    class(family_type), intent(in) :: bare
    real(dp), intent(in) :: parameters(:)
    class(frame_type), allocatable, intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    class(periodic_system), allocatable :: system

    call take_member(bare, parameters, system, error)
    if (allocated(error)) return
    select type (system)
    class is (frame_type)
      allocate(frame, source=system)
    class default
      call fatal_error(error, "vibrations are followed of frames only", failed_computation)
    end select
  end subroutine bare_frame

  !> Both at once; the second anew where the first turns out to need more samples.
  subroutine solve_both(self, q, ends, next, error)
    class(line_path_type), intent(in) :: self
    real(dp), intent(in) :: q(:, :), ends(2)
    type(iterate_type), intent(inout) :: next(2)
    type(error_type), allocatable, intent(out) :: error
    type(iterates_type) :: work

    work%family = self
    work%q = q
    work%ends = ends
    call spread_over(work, 2, error, self%executor)
    if (allocated(error)) return
    next = work%next
    if (size(next(2)%q, 1) < size(next(1)%q, 1)) call next_iterate(self, q, ends(2), size(next(1)%q, 1), next(2), error)
  end subroutine solve_both

  recursive subroutine compute(self, k, error)
    class(iterates_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call next_iterate(self%family, self%q, self%ends(k), size(self%q, 1), self%next(k), error)
  end subroutine compute

  subroutine exchange(self, k, record)
    class(iterates_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    call record%pass(self%next(k)%q)
    call record%pass(self%next(k)%angles)
  end subroutine exchange

end module gestell_task_boundary_vibration_path

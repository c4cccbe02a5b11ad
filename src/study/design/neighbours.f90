!> A machine of a family and its neighbours along each parameter, by which functions of the machine that need no solution, as the
!> coefficients of its equations, are differentiated:
!>
!>     df/dp = (w_0 f(p) + w_1 f(p + d_1 h) + w_2 f(p + d_2 h)) / h,
!>
!> d = -1, 1 or, where there is no machine on one side, 1, 2 or -1, -2. Such functions are known to rounding, so the step needs no
!> guess: h = epsilon^(1/3) of the parameter's range leaves h^2 |f'''| / 6 (/ 3 on one side) and epsilon |f| / h, about 1e-10 of
!> what f changes within the range. (Nocedal, Wright, Numerical Optimization, 2006, section 8.1.)
module gestell_study_design_neighbours
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type
  use gestell_model_mechanism_tabulated, only: new_tabulated, tabulated_type
  use gestell_study_family, only: family_type, take_member
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: at_condition, find_neighbours, remember

  !> How a machine is run: its speed (rad/s; 0: its own), and by which factors speed, stiffness and damping of the mounting differ
  !> from what they should be.
  type, public :: condition_type
    real(dp) :: speed = 0, speed_factor = 1, stiffness_factor = 1, damping_factor = 1
  end type condition_type

  type, public :: neighbours_type
    type(frame_type) :: frame
    !> Shape (2, parameters), and how they are weighed, shapes (2, parameters) and, w_0 / h, w_1 / h, w_2 / h, (0:2, parameters).
    type(frame_type), allocatable :: beside(:, :)
    real(dp), allocatable :: distance(:, :), weight(:, :)
  end type neighbours_type

  real(dp), parameter :: offsets(2, 3) = reshape([-1.0_dp, 1.0_dp, 1.0_dp, 2.0_dp, -1.0_dp, -2.0_dp], [2, 3])
  real(dp), parameter :: weights(0:2, 3) = reshape([0.0_dp, -0.5_dp, 0.5_dp, -1.5_dp, 2.0_dp, -0.5_dp, 1.5_dp, -2.0_dp, 0.5_dp], &
    & [3, 3])

contains

  !> The machine at `parameters`, and with `ranges`, shape (parameters), its neighbours; `known`: there is one. Errors: the
  !> parameters make no sense; the members are no frames.
  subroutine find_neighbours(family, parameters, neighbours, known, error, ranges)
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    type(neighbours_type), intent(out) :: neighbours
    logical, intent(out) :: known
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: ranges(:)
    real(dp) :: h
    integer :: k, side, i

    call take_frame(family, parameters, neighbours%frame, known, error)
    if (allocated(error) .or. .not. known .or. .not. present(ranges)) return
    associate (n => size(parameters))
      allocate(neighbours%beside(2, n), neighbours%distance(2, n), neighbours%weight(0:2, n))
    end associate
    do k = 1, size(parameters)
      h = epsilon(h)**(1.0_dp / 3) * max(ranges(k), epsilon(h)**(1.0_dp / 3) * abs(parameters(k)))
      do side = 1, size(offsets, 2)
        do i = 1, 2
          if (allocated(error)) deallocate(error)
          neighbours%distance(i, k) = offsets(i, side) * h
          call take_frame(family, moved(parameters, k, neighbours%distance(i, k)), neighbours%beside(i, k), known, error)
          if (allocated(error)) known = .false.
          if (.not. known) exit
        end do
        if (known) exit
      end do
      if (.not. known) return
      neighbours%weight(:, k) = weights(:, side) / h
    end do
  end subroutine find_neighbours

  pure function moved(parameters, k, distance)
    real(dp), intent(in) :: parameters(:), distance
    integer, intent(in) :: k
    real(dp) :: moved(size(parameters))

    moved = parameters
    moved(k) = moved(k) + distance
  end function moved

  subroutine take_frame(family, parameters, frame, known, error)
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    type(frame_type), intent(out) :: frame
    logical, intent(out) :: known
    type(error_type), allocatable, intent(out) :: error
    class(periodic_system), allocatable :: system

    call take_member(family, parameters, system, error)
    known = .not. allocated(error)
    if (allocated(error)) then
      if (error%code == impossible_mechanism) deallocate(error)
      return
    end if
    select type (system)
    type is (frame_type)
      frame = system
    class default
      call fatal_error(error, "a design is that of frames", invalid_input)
    end select
  end subroutine take_frame

  !> Tabulates all mechanisms at these phases, with what the drive feels where it is asked for: they are asked again and again, at
  !> all speeds.
  subroutine remember(neighbours, phases, drive)
    type(neighbours_type), intent(inout) :: neighbours
    real(dp), intent(in) :: phases(:)
    logical, intent(in) :: drive
    integer :: i, k

    call remember_one(neighbours%frame)
    if (.not. allocated(neighbours%beside)) return
    do k = 1, size(neighbours%beside, 2)
      do i = 1, size(neighbours%beside, 1)
        call remember_one(neighbours%beside(i, k))
      end do
    end do

  contains

    subroutine remember_one(frame)
      type(frame_type), intent(inout) :: frame
      type(tabulated_type), allocatable :: tabulated

      allocate(tabulated)
      call new_tabulated(tabulated, frame%mechanism)
      call tabulated%remember(frame%crank_angles(phases), drive)
      call move_alloc(tabulated, frame%mechanism)
    end subroutine remember_one

  end subroutine remember

  !> The machine as it is run.
  subroutine at_condition(frame, condition, run)
    type(frame_type), intent(in) :: frame
    type(condition_type), intent(in) :: condition
    type(frame_type), intent(out) :: run

    run = frame
    if (abs(condition%speed) > 0) run%speed = condition%speed
    run%speed = run%speed * condition%speed_factor
    run%period = 2 * pi / abs(run%speed)
    run%stiffness = run%stiffness * condition%stiffness_factor
    run%damping = run%damping * condition%damping_factor
    run%supports%stiffness(1) = run%supports%stiffness(1) * condition%stiffness_factor
    run%supports%stiffness(2) = run%supports%stiffness(2) * condition%stiffness_factor
    run%supports%damping(1) = run%supports%damping(1) * condition%damping_factor
    run%supports%damping(2) = run%supports%damping(2) * condition%damping_factor
  end subroutine at_condition

end module gestell_study_design_neighbours

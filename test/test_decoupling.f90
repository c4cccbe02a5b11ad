!> Uncoupled parts of a system are detected and solved separately, and their results return to the right places.
module test_decoupling
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: floquet_type, follow, solve_floquet, solve_multipliers, solve_periodic
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_mounting, only: stiffness_matrix, support_type
  use gestell_system_subsystem, only: find_subsystems
  use gestell_system_periodic, only: periodic_system
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine
  use systems, only: diagonal
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_decoupling

  !> Three states: x1' = -x1 / 2 + cos t is state 2; states 1 and 3 are Vinograd's system with the period pi / 3 repeated six
  !> times, exponents 2 and -13.
  type, extends(periodic_system) :: woven_type
  contains
    procedure :: matrix => woven_matrix
    procedure :: forcing => woven_forcing
    procedure :: coupled => woven_coupled
  end type woven_type

contains

  subroutine collect_decoupling(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("uncoupled degrees of freedom of a frame are detected", test_frames), &
      & new_unittest("solving uncoupled parts separately agrees with solving the whole", test_parts_and_whole), &
      & new_unittest("interleaved uncoupled states return to their places", test_interleaved)]
  end subroutine collect_decoupling

  subroutine test_frames(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    type(support_type) :: turned(2)

    call frame_of_machine(khang_machine(240.0_dp), frame, failure)
    call expect(frame, [1, 1, 1], "the paper's frame")
    call loosen(frame, [1, 2])
    call expect(frame, [1, 2], "translations only")
    call loosen(frame, [2, 3])
    call expect(frame, [1, 1], "eta and psi")
    turned = [support_type([-0.3_dp, -0.2_dp], [4.0e5_dp, 1.0e5_dp], [50.0_dp, 50.0_dp], 0.3_dp), &
      & support_type([0.3_dp, -0.2_dp], [4.0e5_dp, 1.0e5_dp], [50.0_dp, 50.0_dp], -0.1_dp)]
    frame%stiffness = stiffness_matrix(turned)
    call loosen(frame, [1, 2])
    call expect(frame, [1, 1], "translations on turned supports")
    frame%stiffness = diagonal([1.0e5_dp, 2.0e5_dp, 3.0e4_dp])
    frame%damping = reshape([0.0_dp, 1.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp], [3, 3])
    call loosen(frame, [1, 2])
    call expect(frame, [1, 1], "translations with a damper between them")

  contains

    !> The same frame with other degrees of freedom free.
    subroutine loosen(frame, free)
      type(frame_type), intent(inout) :: frame
      integer, intent(in) :: free(:)
      type(frame_type) :: other

      call new_frame(other, frame%mechanism, frame%mass, frame%inertia, frame%origin, frame%stiffness, frame%damping, &
        & frame%speed, failure, free=free)
      frame%free = other%free
      frame%states = other%states
    end subroutine loosen

    subroutine expect(frame, parts, name)
      type(frame_type), intent(in) :: frame
      integer, intent(in) :: parts(:)
      character(len=*), intent(in) :: name
      integer, allocatable :: found(:)

      if (allocated(error)) return
      call check_success(error, failure)
      if (allocated(error)) return
      call find_subsystems(frame, found, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, found, "==", parts, name)
    end subroutine expect

  end subroutine test_frames

  !> Multipliers, eigenvectors, start and motion of the translations against one monodromy matrix of both.
  subroutine test_parts_and_whole(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 5
    type(frame_type) :: whole, frame
    type(floquet_type) :: floquet
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: apart, together
    type(periodic_solution_type) :: start, expected
    type(gestell_error), allocatable :: failure
    complex(dp) :: defect(4)
    real(dp), allocatable :: x(:, :), y(:, :)
    integer :: i, k

    call frame_of_machine(khang_machine(300.0_dp), whole, failure)
    if (.not. allocated(failure)) call new_frame(frame, whole%mechanism, whole%mass, whole%inertia, whole%origin, &
      & diagonal([5.0e5_dp, 9.0e5_dp, 1.0_dp]), diagonal([20.0_dp, 30.0_dp, 1.0_dp]), whole%speed, failure, free=[2, 1])
    associate (phases => [(real(k, dp) / points, k = 0, points)])
      if (.not. allocated(failure)) call solve_floquet(frame, accuracy_type(tolerance=1.0e-12_dp), .true., floquet, failure)
      if (.not. allocated(failure)) call solve_multipliers(floquet, .true., apart, failure)
      if (.not. allocated(failure)) call solve_periodic(floquet, start, failure)
      if (.not. allocated(failure)) call follow(frame, floquet, start, phases, x, failure)
      if (.not. allocated(failure)) call solve_monodromy(frame, accuracy_type(tolerance=1.0e-12_dp), .true., monodromy, failure)
      if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., together, failure)
      if (.not. allocated(failure)) call solve_periodic(monodromy, expected, failure)
      if (.not. allocated(failure)) call follow(frame, monodromy, expected, phases, y, failure)
    end associate
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, size(floquet%parts), 2)
    if (allocated(error)) return
    ! Each claims 1e-12 of Phi; the condition is below 100.
    do i = 1, 4
      call check_that(error, minval(abs(apart%rho(i) - together%rho)), "<", 1.0e-11_dp, "multipliers")
      if (allocated(error)) return
      defect = matmul(monodromy%phi, apart%vectors(:, i)) - apart%rho(i) * apart%vectors(:, i)
      call check_that(error, norm2(abs(defect)), "<", 1.0e-10_dp, "eigenvectors")
      if (allocated(error)) return
    end do
    call check_that(error, abs(start%x0 - expected%x0), "<=", start%error + expected%error, "start")
    call check_that(error, maxval(abs(x - y) / spread(floquet%scale, 2, points + 1)), "<", 1.0e-9_dp &
      & * maxval(abs(y) / spread(floquet%scale, 2, points + 1)), "motion")
  end subroutine test_parts_and_whole

  subroutine test_interleaved(error)
    type(error_type), allocatable, intent(out) :: error
    type(woven_type) :: system
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: start
    type(gestell_error), allocatable :: failure

    system = woven_type(states=3, period=2 * pi)
    call solve_floquet(system, accuracy_type(), .true., floquet, failure)
    if (.not. allocated(failure)) call solve_multipliers(floquet, .true., multipliers, failure)
    if (.not. allocated(failure)) call solve_periodic(floquet, start, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, size(floquet%parts), 2)
    if (allocated(error)) return
    call check_that(error, maxval(abs(real(multipliers%exponent) - [2.0_dp, -0.5_dp, -13.0_dp])), "<", 1.0e-8_dp, "exponents")
    call check_that(error, maxval(abs(multipliers%vectors([1, 3], 2))) + maxval(abs(multipliers%vectors(2, [1, 3]))), "<=", &
      & 0.0_dp, "eigenvectors")
    ! y' = -y / 2 + cos t: y = (2 cos t + 4 sin t) / 5.
    call check_that(error, maxval(abs(start%x0 - [0.0_dp, 0.4_dp, 0.0_dp])), "<", 1.0e-8_dp, "start")
  end subroutine test_interleaved

  subroutine woven_matrix(self, t, p)
    class(woven_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    associate (unused => self)
    end associate
    associate (c => cos(6 * t), s => sin(6 * t))
      p = 0
      p(2, 2) = -0.5_dp
      p(1, 1) = -1 - 9 * c**2 + 12 * s * c
      p(1, 3) = 12 * c**2 + 9 * s * c
      p(3, 1) = -12 * s**2 + 9 * s * c
      p(3, 3) = -1 - 9 * s**2 - 12 * s * c
    end associate
  end subroutine woven_matrix

  subroutine woven_forcing(self, t, f)
    class(woven_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    associate (unused => self)
    end associate
    f = [0.0_dp, cos(t), 0.0_dp]
  end subroutine woven_forcing

  function woven_coupled(self) result(coupled)
    class(woven_type), intent(in) :: self
    logical, allocatable :: coupled(:, :)

    allocate(coupled(self%states, self%states), source=.true.)
    coupled(2, [1, 3]) = .false.
    coupled([1, 3], 2) = .false.
  end function woven_coupled

end module test_decoupling

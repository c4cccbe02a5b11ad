!> Systems and families with invalid or absurd properties, for the suite `invalid-arguments`, and a list of complaints.
module faulty_systems
  use gestell_api_numerics, only: dp, error_type, failed_computation, family_type, impossible_mechanism, invalid_input, &
    & periodic_system, second_order_system
  use, intrinsic :: ieee_arithmetic, only: ieee_negative_inf, ieee_positive_inf, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: check_answer, nan, infinite, expect

  !> Mathieu's equation for each degree of freedom, with a little damping, with the given `fault`.
  type, extends(second_order_system), public :: faulty_second_order
    character(len=16) :: fault = ""
    real(dp) :: a = 1, q = 0.1_dp
  contains
    procedure :: matrices
    procedure :: load
  end type faulty_second_order

  !> Mathieu's equation in first order.
  type, extends(periodic_system), public :: faulty_first_order
    character(len=16) :: fault = ""
    !> Shape of `coupled` if it differs from that of the states.
    integer :: table = 0
  contains
    procedure :: matrix
    procedure :: forcing
    procedure :: coupled
  end type faulty_first_order

  !> Mathieu's equation over a, with the given `fault`.
  type, extends(family_type), public :: faulty_family
    character(len=16) :: fault = ""
  contains
    procedure :: member
  end type faulty_family

  !> Number of times that coefficients were evaluated.
  integer, public :: evaluations = 0

  !> Upper limit of evaluations for any call: 2**19 steps, at least three numbers of steps, ten stages.
  integer, parameter, public :: too_many = 2**25

contains

  subroutine matrices(self, t, m, b, c)
    class(faulty_second_order), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    integer :: i

    evaluations = evaluations + 1
    m = 0
    b = 0
    c = 0
    do i = 1, size(m, 1)
      m(i, i) = 1
      b(i, i) = 0.01_dp
      c(i, i) = self%a - 2 * self%q * cos(2 * t)
    end do
    select case (self%fault)
    case ("mass nan")
      m = nan()
    case ("stiffness nan")
      c = nan()
    case ("no mass")
      m = 0
    case ("singular mass")
      m = 1
    case ("negative mass")
      m = -m
    case ("least mass")
      m = tiny(1.0_dp)
    case ("small mass")
      m = 1.0e-200_dp * m
    case ("huge stiffness")
      c = huge(1.0_dp)
    case ("great stiffness")
      c = 1.0e150_dp
    case ("repelled")
      c = -1.0e10_dp
    case ("free")
      c = 0
      b = 0
    case ("damping infinite")
      b = infinite()
    case ("great damping")
      b = 1.0e200_dp
    case ("nan later")
      if (t > 0.5_dp) c = nan()
    case ("rough")
      c = c * sin(1.0e6_dp * t)
    case default
      ! sound
    end select
  end subroutine matrices

  subroutine load(self, t, h)
    class(faulty_second_order), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    h = cos(2 * t)
    select case (self%fault)
    case ("load nan")
      h = nan()
    case ("huge load")
      h = huge(1.0_dp)
    case ("least load")
      h = 1.0e-320_dp
    case ("no load")
      h = 0
    case default
      ! sound
    end select
  end subroutine load

  subroutine matrix(self, t, p)
    class(faulty_first_order), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    evaluations = evaluations + 1
    p = 0
    if (size(p, 1) > 1) then
      p(1, 2) = 1
      p(2, 1) = -1 - 0.1_dp * cos(t)
    else
      p = -0.1_dp
    end if
    select case (self%fault)
    case ("nan")
      p = nan()
    case ("infinite")
      p = ieee_value(1.0_dp, ieee_negative_inf)
    case ("huge")
      p = huge(1.0_dp)
    case ("growing")
      p = 1.0e3_dp
    case ("decaying")
      p = -1.0e3_dp
    case ("nothing")
      p = 0
    case default
      ! sound
    end select
  end subroutine matrix

  subroutine forcing(self, t, f)
    class(faulty_first_order), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    f = sin(t)
    if (self%fault == "forcing nan") f = nan()
  end subroutine forcing

  function coupled(self)
    class(faulty_first_order), intent(in) :: self
    logical, allocatable :: coupled(:, :)
    integer :: n

    n = merge(self%table, self%states, self%table > 0)
    allocate(coupled(n, n), source=self%table == 0)
  end function coupled

  subroutine member(self, parameters, system, error)
    class(faulty_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: pi = acos(-1.0_dp)

    select case (self%fault)
    case ("impossible")
      error = error_type(message="no machine here", code=impossible_mechanism)
    case ("strange code")
      error = error_type(message="an error of the user's own", code=77)
    case ("nothing at all")
    case ("no states")
      allocate(system, source=faulty_second_order(states=0, period=pi))
    case ("odd states")
      allocate(system, source=faulty_second_order(states=3, period=pi))
    case ("negative period")
      allocate(system, source=faulty_second_order(states=2, period=-1.0_dp))
    case ("nan")
      allocate(system, source=faulty_second_order(states=2, period=pi, fault="mass nan"))
    case ("changing states")
      allocate(system, source=faulty_first_order(states=merge(2, 3, parameters(1) > 1), period=pi))
    case default
      allocate(system, source=faulty_second_order(states=2, period=pi, a=parameters(1), q=0.2_dp))
    end select
  end subroutine member

  real(dp) function nan()
    nan = ieee_value(1.0_dp, ieee_quiet_nan)
  end function nan

  real(dp) function infinite()
    infinite = ieee_value(1.0_dp, ieee_positive_inf)
  end function infinite

  !> Adds a complaint unless `failure` is an error with this code and a message of one line. Invalid input must be refused
  !> before any coefficient is evaluated.
  subroutine expect(failure, code, what, complaints)
    type(error_type), allocatable, intent(in) :: failure
    integer, intent(in) :: code
    character(len=*), intent(in) :: what
    character(len=:), allocatable, intent(inout) :: complaints

    if (.not. allocated(complaints)) complaints = ""
    if (.not. allocated(failure)) then
      complaints = complaints // what // ": no error; "
    else
      if (failure%code /= code) complaints = complaints // what // ": another code, '" // failure%message // "'; "
      if (len(failure%message) < 10 .or. index(failure%message, new_line("a")) > 0) complaints = complaints // what &
        & // ": '" // failure%message // "'; "
    end if
    if (code == invalid_input .and. evaluations > 0) complaints = complaints // what // ": evaluated; "
    evaluations = 0
  end subroutine expect

  !> Adds a complaint if a call neither succeeded nor failed in a documented way, or did too much work.
  subroutine check_answer(failure, what, complaints)
    type(error_type), allocatable, intent(in) :: failure
    character(len=*), intent(in) :: what
    character(len=:), allocatable, intent(inout) :: complaints

    if (.not. allocated(complaints)) complaints = ""
    if (allocated(failure)) then
      if (all(failure%code /= [invalid_input, impossible_mechanism, failed_computation])) complaints = complaints // what &
        & // ": code out of range, '" // failure%message // "'; "
    end if
    if (evaluations > too_many) complaints = complaints // what // ": too much work; "
    evaluations = 0
  end subroutine check_answer

end module faulty_systems

!> Random numbers for the tests, as short decimals. A seed always yields the same numbers.
module reference_random
  use reference_machine, only: dp
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: random_type, rounded

  !> Linear congruential generator of Park and Miller (multiplier 48271, modulus 2^31 - 1).
  type :: random_type
    integer(int64) :: state = 1
  contains
    procedure :: start
    procedure :: advance
    procedure :: draw
    procedure :: between
    procedure :: about_zero
    procedure :: chance
    procedure :: pick
  end type random_type

contains

  !> Begins the sequence with this number; sequences of different kinds are independent.
  subroutine start(self, number, kind)
    class(random_type), intent(out) :: self
    integer, intent(in) :: number, kind
    integer :: i

    self%state = modulo(104729_int64*number + 12345_int64 + 32452843_int64*kind, 2147483646_int64) + 1
    do i = 1, 10 ! neighbouring numbers start with neighbouring draws
      call self%advance()
    end do
  end subroutine start

  subroutine advance(self)
    class(random_type), intent(inout) :: self

    self%state = modulo(48271_int64*self%state, 2147483647_int64)
  end subroutine advance

  !> The next number, in (0, 1).
  function draw(self) result(u)
    class(random_type), intent(inout) :: self
    real(dp) :: u

    call self%advance()
    u = real(self%state, dp)/2147483647.0_dp
  end function draw

  !> Evenly in [low, high], to four decimals.
  function between(self, low, high) result(u)
    class(random_type), intent(inout) :: self
    real(dp), intent(in) :: low, high
    real(dp) :: u

    u = rounded(low + (high - low)*self%draw(), 4)
  end function between

  !> Evenly in [-limit, limit], to four decimals.
  function about_zero(self, limit) result(u)
    class(random_type), intent(inout) :: self
    real(dp), intent(in) :: limit
    real(dp) :: u

    u = self%between(-limit, limit)
  end function about_zero

  function chance(self, probability) result(yes)
    class(random_type), intent(inout) :: self
    real(dp), intent(in) :: probability
    logical :: yes

    yes = self%draw() < probability
  end function chance

  !> One of 1, ..., n.
  function pick(self, n) result(k)
    class(random_type), intent(inout) :: self
    integer, intent(in) :: n
    integer :: k

    k = ceiling(n*self%draw())
  end function pick

  !> x to the given number of decimals.
  pure function rounded(x, decimals) result(r)
    real(dp), intent(in) :: x
    integer, intent(in) :: decimals
    real(dp) :: r

    r = anint(x*10.0_dp**decimals)/10.0_dp**decimals
  end function rounded

end module reference_random

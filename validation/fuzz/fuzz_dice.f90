!> Random choices that are a function of a seed and a number alone.
module fuzz_dice
  use gestell_base_hash, only: hash_start, mix
  use gestell_base_kinds, only: dp
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: new_dice

  !> Marsaglia's xorshift of 64 bits.
  type, public :: dice_type
    private
    integer(int64) :: state = hash_start
  contains
    procedure :: below
    procedure :: between
    procedure :: chance
    procedure :: uniform
    procedure :: decades
    procedure :: pick
    procedure, private :: pick_real
    procedure, private :: pick_whole
    generic :: pick_of => pick_real, pick_whole
  end type dice_type

contains

  !> The dice of input `number` from `seed`.
  type(dice_type) function new_dice(seed, number) result(dice)
    integer(int64), intent(in) :: seed, number
    integer :: i

    call mix(dice%state, [seed, number])
    if (dice%state == 0) dice%state = hash_start
    do i = 1, 4
      call turn(dice)
    end do
  end function new_dice

  subroutine turn(dice)
    type(dice_type), intent(inout) :: dice

    dice%state = ieor(dice%state, ishft(dice%state, 13))
    dice%state = ieor(dice%state, ishft(dice%state, -7))
    dice%state = ieor(dice%state, ishft(dice%state, 17))
  end subroutine turn

  !> A number from 0 to 1, without 1.
  real(dp) function uniform(self)
    class(dice_type), intent(inout) :: self

    call turn(self)
    uniform = real(ishft(self%state, -11), dp) * 2.0_dp**(-53)
  end function uniform

  !> A whole number from 0 to n - 1.
  integer function below(self, n)
    class(dice_type), intent(inout) :: self
    integer, intent(in) :: n

    below = min(int(self%uniform() * n), n - 1)
  end function below

  !> A number between two.
  real(dp) function between(self, least, most)
    class(dice_type), intent(inout) :: self
    real(dp), intent(in) :: least, most

    between = least + (most - least) * self%uniform()
  end function between

  !> True with that probability.
  logical function chance(self, probability)
    class(dice_type), intent(inout) :: self
    real(dp), intent(in) :: probability

    chance = self%uniform() < probability
  end function chance

  !> Ten to a power between two.
  real(dp) function decades(self, least, most)
    class(dice_type), intent(inout) :: self
    real(dp), intent(in) :: least, most

    decades = 10.0_dp**self%between(least, most)
  end function decades

  !> One of the words, without blanks at its end.
  function pick(self, words) result(word)
    class(dice_type), intent(inout) :: self
    character(len=*), intent(in) :: words(:)
    character(len=:), allocatable :: word

    word = trim(words(1 + self%below(size(words))))
  end function pick

  real(dp) function pick_real(self, values)
    class(dice_type), intent(inout) :: self
    real(dp), intent(in) :: values(:)

    pick_real = values(1 + self%below(size(values)))
  end function pick_real

  integer function pick_whole(self, values)
    class(dice_type), intent(inout) :: self
    integer, intent(in) :: values(:)

    pick_whole = values(1 + self%below(size(values)))
  end function pick_whole

end module fuzz_dice

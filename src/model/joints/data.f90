!> Data of a joint: values of its keys in an input, and checks on the numbers of joints and guides.
module gestell_model_joints_data
  use gestell_base_kinds, only: dp
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: check_coordinates, check_finite, check_lengths

  !> Smallest and largest permitted length of a link (m). Between them squares of lengths, and quotients of squares, neither
  !> underflow nor overflow.
  real(dp), parameter :: shortest = 1.0e-100_dp, longest = 1.0e100_dp

  !> Value of one key. It consists of numbers in SI units and rad, or of indices of joints or of the key's words.
  type :: datum_type
    character(len=16) :: key
    real(dp), allocatable :: numbers(:)
    integer, allocatable :: joints(:)
  end type datum_type

  !> Values of all keys of a joint. They come from the input or are defaults.
  type, public :: joint_data_type
    private
    type(datum_type) :: given(20)
    integer :: count = 0
    !> Reason why the values do not define a joint. The procedure `define` of the joint's type sets it.
    character(len=200), public :: reason = ""
    !> The key that causes the error, if it is a single key.
    character(len=16), public :: key = ""
  contains
    procedure :: add, has, numbers, number, joints
  end type joint_data_type

contains

  !> Adds the value of a key. The value consists of numbers in SI units and rad, or of indices of joints or of the key's words.
  pure subroutine add(self, key, numbers, joints)
    class(joint_data_type), intent(inout) :: self
    character(len=*), intent(in) :: key
    real(dp), intent(in), optional :: numbers(:)
    integer, intent(in), optional :: joints(:)

    self%count = self%count + 1
    self%given(self%count)%key = key
    if (present(numbers)) self%given(self%count)%numbers = numbers
    if (present(joints)) self%given(self%count)%joints = joints
  end subroutine add

  pure integer function index_of(self, key) result(i)
    class(joint_data_type), intent(in) :: self
    character(len=*), intent(in) :: key

    do i = 1, self%count
      if (self%given(i)%key == key) return
    end do
    i = 0
  end function index_of

  !> True if the data contain a value for this key.
  pure logical function has(self, key)
    class(joint_data_type), intent(in) :: self
    character(len=*), intent(in) :: key

    has = index_of(self, key) > 0
  end function has

  !> The numbers of the value of a key. The data must contain this key.
  pure function numbers(self, key)
    class(joint_data_type), intent(in) :: self
    character(len=*), intent(in) :: key
    real(dp), allocatable :: numbers(:)

    allocate(numbers, source=self%given(index_of(self, key))%numbers)
  end function numbers

  !> The first number of the value of a key. The data must contain this key.
  pure real(dp) function number(self, key)
    class(joint_data_type), intent(in) :: self
    character(len=*), intent(in) :: key

    number = self%given(index_of(self, key))%numbers(1)
  end function number

  !> The indices of the joints, or of the words, to which a key refers. The data must contain this key.
  pure function joints(self, key)
    class(joint_data_type), intent(in) :: self
    character(len=*), intent(in) :: key
    integer, allocatable :: joints(:)

    allocate(joints, source=self%given(index_of(self, key))%joints)
  end function joints

  !> Sets `reason` if a number is not finite. A `reason` that is already set is kept.
  pure subroutine check_finite(numbers, reason)
    real(dp), intent(in) :: numbers(:)
    character(len=:), allocatable, intent(inout) :: reason

    if (reason == "" .and. .not. all(ieee_is_finite(numbers))) reason = "all data must be finite numbers"
  end subroutine check_finite

  !> Sets `reason` if a coordinate is not finite or exceeds 1e100 m in magnitude. A `reason` that is already set is kept.
  pure subroutine check_coordinates(coordinates, reason)
    real(dp), intent(in) :: coordinates(:)
    character(len=:), allocatable, intent(inout) :: reason

    call check_finite(coordinates, reason)
    if (reason == "" .and. any(abs(coordinates) > longest)) reason = "coordinates must lie between -1e100 m and 1e100 m"
  end subroutine check_coordinates

  !> Sets `reason` if a length (m) is not between 1e-100 m and 1e100 m, or if the branch is neither 1 nor -1. A `reason` that is
  !> already set is kept.
  pure subroutine check_lengths(lengths, branch, reason)
    real(dp), intent(in) :: lengths(:)
    integer, intent(in) :: branch
    character(len=:), allocatable, intent(inout) :: reason

    call check_finite(lengths, reason)
    if (reason /= "") return
    if (.not. all(lengths > 0)) then
      reason = "lengths must be positive"
    else if (any(lengths < shortest .or. lengths > longest)) then
      reason = "lengths must lie between 1e-100 m and 1e100 m"
    else if (abs(branch) /= 1) then
      reason = "branch must be 1 or -1"
    end if
  end subroutine check_lengths

end module gestell_model_joints_data

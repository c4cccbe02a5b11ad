!> Solves a linear periodic system whose coefficients a C function computes (include/gestell.h).
module gestell_api_c_system
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_api_c_handle, only: code_of, return_numbers, return_text, report_null_pointer
  use gestell_api_system, only: motion_type, solve_system
  use gestell_system_second_order, only: second_order_system
  use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_procpointer, c_funptr, c_int, c_loc, c_ptr
  implicit none (type, external)
  private

  public :: solve_callback_system

  abstract interface
    !> Type of the user's C function, which computes at time `t` the matrices M, B, C and the load h. M, B and C have the shape (f,
    !> f) and are stored row by row; h has the shape (f).
    subroutine coefficients(t, f, m, b, c, h, data) bind(c)
      import :: c_double, c_int, c_ptr
      implicit none (type, external)
      real(c_double), value :: t
      integer(c_int), value :: f
      type(c_ptr), value :: m, b, c, h, data
    end subroutine coefficients
  end interface

  !> A second-order system M q'' + B q' + C q = h whose coefficients a C function computes
  type, extends(second_order_system) :: callback_system
    procedure(coefficients), pointer, nopass :: callback => null()
    type(c_ptr) :: data
  contains
    procedure :: matrices, load, sample_second_order
  end type callback_system

  !> Maximum number of degrees of freedom. Larger systems would need too much memory and time.
  integer, parameter :: most = 1000

contains

  !> Solves M q'' + B q' + C q = h for f degrees of freedom. `multipliers` receives 6 f numbers: 2 f real parts, 2 f imaginary
  !> parts and 2 f error bounds. `motion` receives the state (q, q') at points + 1 equidistant times of the period, with 2 f
  !> numbers for each time, and then the error bounds of the 2 f components of the state. If `motion` is null, no motion is
  !> computed.
  integer(c_int) function solve_callback_system(f, period, callback, data, tolerance, size, verdict, multipliers, points, motion, &
    & failure) result(code) bind(c, name="gestell_solve_system")
    integer(c_int), value :: f, size, points
    real(c_double), value :: period, tolerance
    type(c_funptr), value :: callback
    type(c_ptr), value :: data, verdict, multipliers, motion, failure
    type(callback_system) :: system
    type(motion_type) :: solved
    type(error_type), allocatable :: error
    integer, allocatable :: intervals
    integer :: n

    n = 2 * min(int(f), most)
    if (f > most) call fatal_error(error, "the system must have at most 1000 degrees of freedom", invalid_input)
    if (.not. allocated(error) .and. .not. c_associated(callback)) call report_null_pointer("the function for the coefficients", &
      & error)
    if (.not. allocated(error) .and. .not. c_associated(multipliers)) call report_null_pointer("the array for the multipliers", &
      & error)
    if (.not. allocated(error)) then
      system%states = n
      system%period = period
      system%data = data
      call c_f_procpointer(callback, system%callback)
      ! An unallocated variable counts as an absent argument.
      if (c_associated(motion)) intervals = int(points)
      call solve_system(system, solved, error, tolerance, intervals)
    end if
    if (.not. allocated(error)) call return_text(trim(solved%verdict), size, verdict, error)
    if (.not. allocated(error)) then
      call return_numbers([real(solved%multipliers), aimag(solved%multipliers), solved%errors], multipliers)
      if (c_associated(motion)) call return_numbers([solved%x, solved%x_error], motion)
    end if
    code = code_of(error, failure)
  end function solve_callback_system

  subroutine matrices(self, t, m, b, c)
    class(callback_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    real(c_double), target :: all(size(m, 1)**2, 3), h(size(m, 1))

    call self%callback(t, int(size(m, 1), c_int), c_loc(all(:, 1)), c_loc(all(:, 2)), c_loc(all(:, 3)), c_loc(h), self%data)
    m = transpose(reshape(all(:, 1), shape(m)))
    b = transpose(reshape(all(:, 2), shape(m)))
    c = transpose(reshape(all(:, 3), shape(m)))
  end subroutine matrices

  subroutine load(self, t, h)
    class(callback_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)
    real(c_double), target :: all(size(h)**2, 3), load_values(size(h))

    load_values = 0
    call self%callback(t, int(size(h), c_int), c_loc(all(:, 1)), c_loc(all(:, 2)), c_loc(all(:, 3)), c_loc(load_values), self%data)
    h = load_values
  end subroutine load

  !> Computes M, B, C and h at all `phases`; the C function is called once for each phase.
  subroutine sample_second_order(self, phases, m, b, c, h)
    class(callback_system), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)
    real(c_double), target :: all(size(m, 2)**2, 3), load_values(size(m, 2))
    integer :: f, k

    f = size(m, 2)
    do k = 1, size(phases)
      load_values = 0
      call self%callback(phases(k) * self%period, int(f, c_int), c_loc(all(:, 1)), c_loc(all(:, 2)), c_loc(all(:, 3)), &
        & c_loc(load_values), self%data)
      m(k, :, :) = transpose(reshape(all(:, 1), [f, f]))
      b(k, :, :) = transpose(reshape(all(:, 2), [f, f]))
      c(k, :, :) = transpose(reshape(all(:, 3), [f, f]))
      if (present(h)) h(k, :) = load_values
    end do
  end subroutine sample_second_order

end module gestell_api_c_system

!> Solves a linear periodic system whose coefficients a C function computes (include/gestell.h).
module gestell_door_c_system
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_door_c_handle, only: code_of, give_text, no_handle
  use gestell_door_system, only: motion_type, solve_system
  use gestell_system_second_order, only: second_order_system
  use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_f_procpointer, c_funptr, c_int, c_loc, c_ptr
  implicit none (type, external)
  private

  public :: solve_called

  abstract interface
    !> C function that computes M, B, C, each of shape (f, f) and stored row by row, and h, of shape (f), at time t.
    subroutine coefficients(t, f, m, b, c, h, data) bind(c)
      import :: c_double, c_int, c_ptr
      implicit none (type, external)
      real(c_double), value :: t
      integer(c_int), value :: f
      type(c_ptr), value :: m, b, c, h, data
    end subroutine coefficients
  end interface

  !> A second-order system whose coefficients a C function computes
  type, extends(second_order_system) :: called_type
    procedure(coefficients), pointer, nopass :: give => null()
    type(c_ptr) :: data
  contains
    procedure :: matrices
    procedure :: load
    procedure :: sample_second_order
  end type called_type

  !> Maximum number of degrees of freedom; more would take too much memory and time.
  integer, parameter :: most = 1000

contains

  !> Solves M q'' + B q' + C q = h with f degrees of freedom. `multipliers` receives 2 f real parts, 2 f imaginary parts and 2 f
  !> error bounds. `motion`, unless null, receives (q, q') at points + 1 equidistant times of the period, 2 f numbers each, then 2 f
  !> bounds on their errors.
  integer(c_int) function solve_called(f, period, give, data, tolerance, size, verdict, multipliers, points, motion, failure) &
    & result(code) bind(c, name="gestell_solve_system")
    integer(c_int), value :: f, size, points
    real(c_double), value :: period, tolerance
    type(c_funptr), value :: give
    type(c_ptr), value :: data, verdict, multipliers, motion, failure
    type(called_type) :: system
    type(motion_type) :: found
    type(error_type), allocatable :: error
    real(c_double), pointer :: place(:)
    integer :: n

    n = 2 * min(int(f), most)
    if (f > most) call fatal_error(error, "the system must have at most 1000 degrees of freedom", invalid_input)
    if (.not. allocated(error) .and. .not. c_associated(give)) call no_handle("the function for the coefficients", error)
    if (.not. allocated(error) .and. .not. c_associated(multipliers)) call no_handle("the array for the multipliers", error)
    if (.not. allocated(error)) then
      system%states = n
      system%period = period
      system%data = data
      call c_f_procpointer(give, system%give)
      if (c_associated(motion)) then
        call solve_system(system, found, error, tolerance, int(points))
      else
        call solve_system(system, found, error, tolerance)
      end if
    end if
    if (.not. allocated(error)) call give_text(trim(found%verdict), size, verdict, error)
    if (.not. allocated(error)) then
      call c_f_pointer(multipliers, place, [3 * n])
      place = [real(found%multipliers), aimag(found%multipliers), found%errors]
      if (c_associated(motion)) then
        call c_f_pointer(motion, place, [n * (int(points) + 2)])
        place = [found%x, found%x_error]
      end if
    end if
    code = code_of(error, failure)
  end function solve_called

  subroutine matrices(self, t, m, b, c)
    class(called_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    real(c_double), target :: all(size(m, 1)**2, 3), h(size(m, 1))

    call self%give(t, int(size(m, 1), c_int), c_loc(all(:, 1)), c_loc(all(:, 2)), c_loc(all(:, 3)), c_loc(h), self%data)
    m = transpose(reshape(all(:, 1), shape(m)))
    b = transpose(reshape(all(:, 2), shape(m)))
    c = transpose(reshape(all(:, 3), shape(m)))
  end subroutine matrices

  subroutine load(self, t, h)
    class(called_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)
    real(c_double), target :: all(size(h)**2, 3), given(size(h))

    given = 0
    call self%give(t, int(size(h), c_int), c_loc(all(:, 1)), c_loc(all(:, 2)), c_loc(all(:, 3)), c_loc(given), self%data)
    h = given
  end subroutine load

  !> Computes the matrices and the load at all phases, with one call of the C function for each phase.
  subroutine sample_second_order(self, phases, m, b, c, h)
    class(called_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)
    real(c_double), target :: all(size(m, 2)**2, 3), given(size(m, 2))
    integer :: f, k

    f = size(m, 2)
    do k = 1, size(phases)
      given = 0
      call self%give(phases(k) * self%period, int(f, c_int), c_loc(all(:, 1)), c_loc(all(:, 2)), c_loc(all(:, 3)), c_loc(given), &
        & self%data)
      m(k, :, :) = transpose(reshape(all(:, 1), [f, f]))
      b(k, :, :) = transpose(reshape(all(:, 2), [f, f]))
      c(k, :, :) = transpose(reshape(all(:, 3), [f, f]))
      if (present(h)) h(k, :) = given
    end do
  end subroutine sample_second_order

end module gestell_door_c_system

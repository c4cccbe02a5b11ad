!> One row of the tables: what the library claims of its errors beside what they are.
module extreme_rows
  use extreme_library, only: answer_type
  use extreme_references, only: certain, reference_type
  use reference_linear, only: qp
  use reference_machine, only: dp, pi_qp
  implicit none (type, external)
  private

  public :: row_type, compare, row_text, header

  !> Of multipliers the largest error relative to what comes out (1 where nothing is right), of ln|rho| the largest
  !> absolute one, of x0 the largest of its four parts (xi and eta, psi, and their velocities), relative to that part.
  !> Negative: the reference does not know.
  type :: row_type
    real(dp) :: claimed_rho = 0, true_rho = -1, true_log = -1, claimed_x0 = 0, true_x0 = -1
    !> Some true error is above what was claimed for that value; the verdict is not that of the reference.
    logical :: beaten = .false., wrong = .false.
    !> Largest of claimed over true error, true ones below `least` taken as that.
    real(dp) :: wide_rho = 0, wide_x0 = 0
  end type row_type

  !> True errors below this are roundoff of a single number.
  real(dp), parameter :: least = 1.0e-16_dp
  integer, parameter :: part(6) = [1, 1, 2, 3, 3, 4]

  character(len=*), parameter :: header(2) = [character(len=132) :: &
    & '| case | verdict | rho_max | min ln abs rho | abs x0 | rho claimed | rho true | ln abs rho true | x0 claimed | x0 true |', &
    & '|---|---|---|---|---|---|---|---|---|---|']

contains

  function compare(answer, reference) result(row)
    type(answer_type), intent(in) :: answer
    type(reference_type), intent(in) :: reference
    type(row_type) :: row
    integer :: partner(6)

    if (allocated(answer%log_abs)) row%claimed_rho = maxval(answer%error_rho)
    if (allocated(answer%log_abs) .and. reference%change_rho <= certain) then
      partner = best_matching(answer, reference%log_rho)
      call compare_multipliers(answer, reference%log_rho(partner), row)
    end if
    if (allocated(answer%x0) .and. reference%change_x0 <= certain) call compare_x0(answer, reference%x0, row)
  end function compare

  subroutine compare_multipliers(answer, right, row)
    type(answer_type), intent(in) :: answer
    complex(qp), intent(in) :: right(:)
    type(row_type), intent(inout) :: row
    real(dp) :: error
    integer :: i

    do i = 1, size(right)
      error = relative(answer, i, right(i))
      row%true_rho = max(row%true_rho, error)
      row%true_log = max(row%true_log, real(abs(answer%log_abs(i) - real(right(i))), dp))
      row%beaten = row%beaten .or. error > answer%error_rho(i)
      row%wide_rho = max(row%wide_rho, answer%error_rho(i)/max(error, least))
    end do
    row%wrong = (answer%verdict == 'stable' .and. any(real(right) >= 0)) .or. &
      & (answer%verdict == 'unstable' .and. all(real(right) <= 0))
  end subroutine compare_multipliers

  !> |right/rho - 1|, from the logarithms: relative to the rho that comes out, as what is claimed.
  function relative(answer, i, right) result(error)
    type(answer_type), intent(in) :: answer
    integer, intent(in) :: i
    complex(qp), intent(in) :: right
    real(dp) :: error
    complex(qp) :: d

    d = right - cmplx(answer%log_abs(i), answer%arg(i), qp)
    d = cmplx(real(d), aimag(d) - 2*pi_qp*anint(aimag(d)/(2*pi_qp)), qp)
    if (real(d) > 600) then
      error = huge(error)
    else if (abs(d) < 1.0e-8_qp) then
      error = real(abs(d*(1 + d/2)), dp)
    else
      error = real(abs(exp(d) - 1), dp)
    end if
  end function relative

  subroutine compare_x0(answer, right, row)
    type(answer_type), intent(in) :: answer
    real(qp), intent(in) :: right(:)
    type(row_type), intent(inout) :: row
    real(dp) :: error(size(right)), extent
    integer :: i

    error = real(abs(answer%x0 - right), dp)
    row%beaten = row%beaten .or. any(error > answer%error_x0)
    do i = 1, maxval(part)
      extent = real(maxval(abs(right), mask=part == i), dp)
      row%claimed_x0 = max(row%claimed_x0, maxval(answer%error_x0, mask=part == i)/extent)
      row%true_x0 = max(row%true_x0, maxval(error, mask=part == i)/extent)
    end do
    row%wide_x0 = row%claimed_x0/max(row%true_x0, least)
  end subroutine compare_x0

  !> The multiplier that each of the answer's stands for: of all ways to match them that whose largest true error over
  !> claimed error is least.
  function best_matching(answer, right) result(best)
    type(answer_type), intent(in) :: answer
    complex(qp), intent(in) :: right(:)
    integer :: best(size(right))
    real(dp) :: ratio(size(right), size(right)), least_ratio
    integer :: i, k, order(size(right))

    do k = 1, size(right)
      do i = 1, size(right)
        ratio(i, k) = relative(answer, i, right(k))/max(answer%error_rho(i), tiny(1.0_dp))
      end do
    end do
    best = [(i, i = 1, size(right))]
    order = best
    least_ratio = huge(1.0_dp)
    call try(ratio, order, 1, 0.0_dp, least_ratio, best)
  end function best_matching

  recursive subroutine try(ratio, order, first, so_far, least_ratio, best)
    real(dp), intent(in) :: ratio(:, :), so_far
    integer, intent(inout) :: order(:), best(:)
    integer, intent(in) :: first
    real(dp), intent(inout) :: least_ratio
    integer :: i

    if (so_far >= least_ratio) return
    if (first > size(order)) then
      least_ratio = so_far
      best = order
      return
    end if
    do i = first, size(order)
      order([first, i]) = order([i, first])
      call try(ratio, order, first + 1, max(so_far, ratio(first, order(first))), least_ratio, best)
      order([first, i]) = order([i, first])
    end do
  end subroutine try

  function row_text(label, answer, row) result(line)
    character(len=*), intent(in) :: label
    type(answer_type), intent(in) :: answer
    type(row_type), intent(in) :: row
    character(len=:), allocatable :: line

    line = '| ' // trim(label) // ' | '
    if (.not. allocated(answer%log_abs)) then
      line = line // 'declined: ' // answer%message // ' |||||||||'
      return
    end if
    line = line // trim(trim(answer%verdict) // merge(' WRONG', '      ', row%wrong)) // ' | ' // plain(exp(answer%log_abs(1))) &
      & // ' | ' // short(minval(answer%log_abs), 4) // ' | '
    if (allocated(answer%x0)) line = line // short(norm2(answer%x0), 4)
    line = line // ' | ' // short(row%claimed_rho, 1) // ' | ' // short(row%true_rho, 1) // ' | ' // short(row%true_log, 1) &
      & // ' | '
    if (allocated(answer%x0)) then
      line = line // short(row%claimed_x0, 1) // ' | ' // short(row%true_x0, 1) // ' |'
    else
      line = line // 'declined: ' // answer%message // ' ||'
    end if
  end function row_text

  function short(value, digits) result(word)
    real(dp), intent(in) :: value
    integer, intent(in) :: digits
    character(len=:), allocatable :: word
    character(len=24) :: form, buffer

    write (form, '(a, i0, a)') '(es24.', digits, 'e4)'
    write (buffer, form) value
    word = squeezed(buffer)
  end function short

  function plain(value) result(word)
    real(dp), intent(in) :: value
    character(len=:), allocatable :: word
    character(len=24) :: buffer

    write (buffer, '(f24.12)') value
    word = trim(adjustl(buffer))
    if (value > 1000 .or. value < 1.0e-3_dp) word = short(value, 6)
  end function plain

  !> 1.0E-0009 as 1.0e-9.
  function squeezed(buffer) result(word)
    character(len=*), intent(in) :: buffer
    character(len=:), allocatable :: word
    character(len=8) :: digits
    integer :: place, power

    place = index(buffer, 'E')
    read (buffer(place + 1:), *) power
    write (digits, '(i0)') power
    word = trim(adjustl(buffer(:place - 1))) // 'e' // trim(digits)
  end function squeezed

end module extreme_rows

!> Matches the modes at one speed with the modes at another speed (doc/theory.md, equation 79).
module gestell_study_mode_tracking
  use gestell_base_kinds, only: dp
  use gestell_study_mode, only: assurance, mode_type
  implicit none (type, external)
  private

  public :: track

  !> Likeness (0 to 1) is computed by `compare`. `alike`: two modes at different speeds count as the same mode if their likeness
  !> reaches this value. `apart`: an assignment of modes is unambiguous if the second-best assignment has at most this fraction of
  !> its product of likenesses.
  real(dp), parameter :: alike = 0.8_dp, apart = 0.7_dp

contains

  !> Sorts `modes` into the order of the modes at the previous speed, `last`. Each mode gets as principal component the component
  !> that is most similar, in shape and frequency, to the principal component of its predecessor in `last`. A mode that is not
  !> identified is put in one of the remaining positions.
  pure subroutine track(last, mass, base, modes, like, unambiguous)
    !> Modes at the previous speed, in the order that `modes` will get
    type(mode_type), intent(in) :: last(:)
    !> `mass`: mean of the mass matrix, shape (f, f). `base`: 2 pi / T (rad/s)
    real(dp), intent(in) :: mass(:, :), base
    !> Modes at the new speed. On return they are in the order of `last`
    type(mode_type), intent(inout) :: modes(:)
    !> `like`: true if every mode is similar to its predecessor; then the step of the speed is small enough. `unambiguous`: true
    !> if, in addition, no other assignment is nearly as good. Where modes mix, several assignments may be equally good
    logical, intent(out) :: like, unambiguous
    type(mode_type) :: ordered(size(modes))
    real(dp) :: likeness(size(last), size(modes)), best, second, least
    integer :: component(size(last), size(modes)), order(size(modes)), trial(size(modes)), f, i, j

    f = size(last)
    do i = 1, f
      do j = 1, f
        call compare(last(j), modes(i), mass, base, likeness(j, i), component(j, i))
      end do
    end do
    best = -1
    second = -1
    call assign(likeness, 1, 1.0_dp, trial, order, best, second)
    least = 1
    do j = 1, f
      ordered(j) = modes(order(j))
      ordered(j)%principal = component(j, order(j))
      if (ordered(j)%identified .and. last(j)%identified) least = min(least, likeness(j, order(j)))
    end do
    like = least >= alike
    unambiguous = like .and. second <= apart * best
    modes = ordered
  end subroutine track

  !> Assigns the modes to the modes at the previous speed. Finds the assignment with the largest product of likenesses (`order`,
  !> product `best`), and the second-largest product (`second`). The modes before number `from` are already assigned in `trial`;
  !> `total` is the product of their likenesses. Likenesses are at most 1. An incomplete assignment is therefore abandoned if its
  !> product does not exceed the second-largest product.
  pure recursive subroutine assign(likeness, from, total, trial, order, best, second)
    real(dp), intent(in) :: likeness(:, :), total
    integer, intent(in) :: from
    integer, intent(inout) :: trial(:), order(:)
    real(dp), intent(inout) :: best, second
    integer :: k

    if (total <= second) return
    if (from > size(trial)) then
      second = max(second, min(total, best))
      if (total > best) order = trial
      best = max(best, total)
      return
    end if
    do k = 1, size(trial)
      if (any(trial(:from - 1) == k)) cycle
      trial(from) = k
      call assign(likeness, from + 1, total * likeness(from, k), trial, order, best, second)
    end do
  end subroutine assign

  !> Computes the likeness of a mode to a mode at the previous speed (0 to 1), and the index of the component that is most similar.
  pure subroutine compare(last, mode, mass, base, likeness, component)
    type(mode_type), intent(in) :: last, mode
    real(dp), intent(in) :: mass(:, :), base
    real(dp), intent(out) :: likeness
    integer, intent(out) :: component
    !> `unknown`: likeness of modes that are not identified. `weight`: factor on the share of components other than the strongest
    !> one. `step`: change of the frequency that halves the likeness, in units of `base`
    real(dp), parameter :: unknown = 1.0e-3_dp, weight = 2, step = 0.25_dp
    real(dp) :: one
    integer :: k

    likeness = unknown
    component = 1
    if (.not. (last%identified .and. mode%identified)) return
    do k = 1, mode%components
      one = assurance(last%shape(), mode%shapes(:, k), mass) / (1 + ((mode%frequencies(k) - last%frequency()) / (step * base))**2)
      if (k > 1) one = one * min(1.0_dp, weight * mode%shares(k) / mode%shares(1))
      if (one <= likeness) cycle
      likeness = one
      component = k
    end do
  end subroutine compare

end module gestell_study_mode_tracking

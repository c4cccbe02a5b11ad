!> Which modes at one speed are which at another one.
module gestell_study_mode_tracking
  use gestell_base_kinds, only: dp
  use gestell_study_mode_type, only: assurance, mode_type
  implicit none (type, external)
  private

  public :: track

  !> Likeness from which two modes are taken for the same without further proof, and how much less like all other
  !> assignments have to be.
  real(dp), parameter :: alike = 0.8_dp, apart = 0.7_dp

contains

  !> Puts `modes` into the order of `last`, and names each by the component that continues the one of `last`: the most like
  !> in shape and frequency. `mass`: the mean mass matrix, shape (f, f); `base`: 2 pi / T (rad/s). `like`: each is like the last
  !> one, so that a smaller step need not be taken; `unambiguous`: no other assignment is nearly as good either, as where modes mix.
  !> A mode that is not identified takes the place that is left.
  pure subroutine track(last, mass, base, modes, like, unambiguous)
    type(mode_type), intent(in) :: last(:)
    real(dp), intent(in) :: mass(:, :), base
    type(mode_type), intent(inout) :: modes(:)
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

  !> Finds the assignment of modes to the last ones whose product of likenesses is the greatest (`order`, `best`), and the product
  !> of the second best. The modes before `from` are assigned in `trial`, `total` is their product. Likenesses are at most 1, so a
  !> product that has fallen to the second best cannot matter any more.
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

  !> How like a mode is to the last one, by its best component, from 0 to 1.
  pure subroutine compare(last, mode, mass, base, likeness, component)
    type(mode_type), intent(in) :: last, mode
    real(dp), intent(in) :: mass(:, :), base
    real(dp), intent(out) :: likeness
    integer, intent(out) :: component
    !> Of what is not known; of components weaker than the strongest; a step of the frequency, in that of the period, that
    !> halves the likeness.
    real(dp), parameter :: unknown = 1.0e-3_dp, weight = 2, step = 0.25_dp
    real(dp) :: one
    integer :: k

    likeness = unknown
    component = 1
    if (.not. (last%identified .and. mode%identified)) return
    do k = 1, mode%components
      one = assurance(last%shape(), mode%shapes(:, k), mass) &
        & / (1 + ((mode%frequencies(k) - last%frequency()) / (step * base))**2)
      if (k > 1) one = one * min(1.0_dp, weight * mode%shares(k) / mode%shares(1))
      if (one <= likeness) cycle
      likeness = one
      component = k
    end do
  end subroutine compare

end module gestell_study_mode_tracking

!> Tests whether a system's coefficients are smooth functions of time, and locates a jump or kink.
module gestell_api_roughness
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: describe_roughness, rows

  !> Names of the matrices and the load of a second-order system in error messages.
  character(len=24), parameter, public :: coefficient_names(4) = &
    & [character(len=24) :: "the mass matrix M", "the damping matrix B", "the stiffness matrix C", "the load h"]

  !> `points`: number of equidistant times at which the coefficients are sampled; `block`: number of these times per call.
  integer, parameter :: points = 4096, block = 64
  !> Thresholds for a test of smoothness. The tested ratio is the maximum fourth difference of samples with doubled spacing,
  !> divided by the maximum fourth difference of samples with single spacing. This ratio is 16 for a smooth function, 4 at a jump
  !> of the second derivative, 2 at a kink and 1 at a jump. A ratio above `smooth` indicates a smooth function, a smaller one
  !> above `curved` a jump of the second derivative, a smaller one above `bent` a kink, and one below `bent` a jump.
  real(dp), parameter :: smooth = 8, curved = 2.9_dp, bent = 1.45_dp
  !> If large differences occur at no more than this many times, they are caused by a few jumps. If they occur at more times, the
  !> function is rough everywhere.
  integer, parameter :: few_places = 40

contains

  !> For each phase: weighted sum of the elements of `a`, shape (phases, f, f). Every element has a different weight, so that
  !> changes of two elements do not cancel.
  pure function rows(a) result(sums)
    real(dp), intent(in) :: a(:, :, :)
    real(dp) :: sums(size(a, 1))
    real(dp), parameter :: golden = 0.6180339887498949_dp
    integer :: i, j

    sums = 0
    do j = 1, size(a, 3)
      do i = 1, size(a, 2)
        sums = sums + (1 + modulo(golden * (i + 7 * j), 1.0_dp)) * a(:, i, j)
      end do
    end do
  end function rows

  !> Returns a sentence that names a coefficient that is not smooth, and the time of its jump or kink. `sentence` stays unallocated
  !> if all coefficients are smooth. `calls` is increased by the number of evaluations.
  subroutine describe_roughness(system, calls, sentence)
    class(periodic_system), intent(in) :: system
    integer, intent(inout) :: calls
    character(len=:), allocatable, intent(out) :: sentence
    real(dp), allocatable :: values(:, :)
    character(len=24) :: names(4)
    integer :: j, k

    call sample_sums(system, [((k - 0.5_dp) / points, k = 1, points)], values, names)
    calls = calls + 2 * points
    do j = 1, size(values, 2)
      call find_rough_place(system, j, trim(names(j)), values(:, j), calls, sentence)
      if (allocated(sentence)) return
    end do
  end subroutine describe_roughness

  !> Computes for each phase and each coefficient the weighted sum of the coefficient's elements. `values` has the shape (phases,
  !> coefficients); `names` receives the names of the coefficients.
  subroutine sample_sums(system, phases, values, names)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: phases(:)
    real(dp), allocatable, intent(out) :: values(:, :)
    ! allow(C072)
    character(len=*), intent(out) :: names(4)
    real(dp), allocatable, dimension(:, :, :) :: m, b, c
    real(dp), allocatable :: h(:, :)
    integer :: first, last, n, i, k

    n = system%states
    names = coefficient_names
    select type (system)
    class is (second_order_system)
      allocate(values(size(phases), 4))
    class default
      allocate(values(size(phases), 2))
      names(:2) = [character(len=24) :: "the matrix P", "the load f"]
    end select
    do first = 1, size(phases), block
      last = min(first + block - 1, size(phases))
      associate (part => values(first:last, :), at => phases(first:last), count => last - first + 1)
        select type (system)
        class is (second_order_system)
          allocate(m(count, n / 2, n / 2), b(count, n / 2, n / 2), c(count, n / 2, n / 2), h(count, n / 2))
          call system%sample_second_order(at, m, b, c, h)
          part(:, 1) = rows(m)
          part(:, 2) = rows(b)
          part(:, 3) = rows(c)
          part(:, 4) = [(sum([(h(k, i) * i, i = 1, n / 2)]), k = 1, count)]
          deallocate(m, b, c, h)
        class default
          allocate(m(n, n, count), h(n, count))
          call system%sample(at, m, h)
          part(:, 1) = rows(reshape(m, [count, n, n], order=[2, 3, 1]))
          part(:, 2) = [(sum([(h(i, k) * i, i = 1, n)]), k = 1, count)]
          deallocate(m, h)
        end select
      end associate
    end do
  end subroutine sample_sums

  !> Describes in `sentence` where coefficient `which` is not smooth; `sentence` stays unallocated if the coefficient is smooth.
  !> Finds the largest fourth differences, away from the breaks that the system declares. Samples again around their time with
  !> decreasing spacing, because a smooth function may have peaks or oscillations that the first sampling does not resolve.
  subroutine find_rough_place(system, which, name, values, calls, sentence)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: which
    character(len=*), intent(in) :: name
    real(dp), intent(in) :: values(:)
    integer, intent(inout) :: calls
    character(len=:), allocatable, intent(out) :: sentence
    !> `refinements`: number of repeated samplings, each with a quarter of the previous spacing; `points_per_refinement`: number of
    !> times in each of these samplings.
    integer, parameter :: refinements = 5, points_per_refinement = 65
    real(dp), allocatable :: near(:), around(:, :)
    real(dp) :: ratio, spacing, place
    character(len=:), allocatable :: how
    character(len=24) :: names(4)
    logical :: everywhere
    integer :: k, refinement

    spacing = 1.0_dp / points
    call compute_differences(values, 0.5_dp * spacing, near, ratio, place)
    if (ratio > smooth) return
    everywhere = count(near > 0.3_dp * maxval(near)) > few_places
    do refinement = 1, refinements
      spacing = spacing / 4
      associate (from => max(0.0_dp, min(place - (points_per_refinement - 1) * spacing / 2, 1 - points_per_refinement * spacing)))
        call sample_sums(system, [(from + k * spacing, k = 0, points_per_refinement - 1)], around, names)
        call compute_differences(around(:, which), from, near, ratio, place)
      end associate
      calls = calls + 2 * points_per_refinement
      if (ratio > smooth) return
    end do
    if (everywhere) then
      sentence = name // " is not a smooth function of time: it varies irregularly between " // concise(real(points, dp), 4) &
        & // " equidistant times of the period (check that the same time always gives the same value)"
      return
    end if
    how = "jumps"
    if (ratio > bent) how = "has a kink"
    if (ratio > curved) how = "has a jump in its second derivative"
    sentence = name // " " // how // " near t = " // concise(place * system%period, 4) // " (" // concise(place, 4) &
      & // " of the period): make it smooth, or list this time in `breaks`"

  contains

    !> Computes the magnitudes `sizes` of the fourth differences of the samples `y`, the phase `place` of the largest one, and the
    !> ratio that is compared with `smooth`. The first sample belongs to phase `from`. If all differences are rounding errors, the
    !> ratio is huge, as for a smooth function.
    subroutine compute_differences(y, from, sizes, ratio, place)
      real(dp), intent(in) :: y(:), from
      real(dp), allocatable, intent(out) :: sizes(:)
      real(dp), intent(out) :: ratio, place
      real(dp) :: far(size(y))
      integer :: k

      allocate(sizes(size(y)), source=0.0_dp)
      far = 0
      do k = 5, size(y) - 4
        if (allocated(system%breaks)) then
          if (any(abs(system%breaks / system%period - from - (k - 1) * spacing) <= 4.5_dp * spacing)) cycle
        end if
        sizes(k) = abs(y(k - 2) - 4 * y(k - 1) + 6 * y(k) - 4 * y(k + 1) + y(k + 2))
        far(k) = abs(y(k - 4) - 4 * y(k - 2) + 6 * y(k) - 4 * y(k + 2) + y(k + 4))
      end do
      place = from + (maxloc(sizes, dim=1) - 1) * spacing
      ratio = huge(ratio)
      if (maxval(sizes) > 1.0e4_dp * epsilon(1.0_dp) * maxval(abs(y))) ratio = maxval(far) / maxval(sizes)
    end subroutine compute_differences

  end subroutine find_rough_place

end module gestell_api_roughness

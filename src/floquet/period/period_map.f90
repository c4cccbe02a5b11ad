!> Composes the affine maps of the steps to the map over a whole period, and computes motions from the maps of the steps.
module gestell_floquet_period_period_map
  use gestell_base_error, only: error_type, failed_computation, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  use gestell_math_lapack, only: inverse
  use gestell_math_matrix, only: balanced, unit_matrix
  use gestell_base_text, only: text
  use gestell_floquet_integrator_mesh, only: refined
  use gestell_floquet_integrator_method, only: method_type, unresolved_type
  use gestell_floquet_period_composition, only: follow_maps, multiply_maps, transient_type
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: check_phases, end_of_block, motions, period_map, trajectory

  !> Map over the period. Phi(T) has the shape (n, n). x_p(T) has the shape (n) and is allocated only if loads were requested
  type, public :: period_map_type
    real(dp), allocatable :: phi(:, :), xp(:)
  end type period_map_type

  !> State transition matrices of consecutive segments of the period
  type, public :: segments_type
    !> Ends t_k of the K segments, as phases, shape (0:K)
    real(dp), allocatable :: ends(:)
    !> Matrices Phi(t_k, t_{k-1}), shape (n, n, K)
    real(dp), allocatable :: maps(:, :, :)
  end type segments_type

  !> Minimum and maximum number of segments, if there are enough steps
  integer, parameter :: min_segments = 4, max_segments = 12
  !> Number of steps whose maps are stored together. Because of this limit the memory does not grow with the number of steps, and
  !> the maps remain in the cache.
  integer, parameter, public :: block_length = 32

contains

  !> Number of the last step of the block that begins with step `first`. `steps`: total number of steps. The last block contains at
  !> least `lanes` steps, the number that is computed together, because shorter blocks are expensive.
  pure integer function end_of_block(first, steps) result(last)
    integer, intent(in) :: first, steps

    last = min(first + block_length - 1, steps)
    if (steps - last > 0 .and. steps - last < lanes) last = last - lanes
  end function end_of_block

  !> Fails unless the phases are ascending and lie within [0, 1].
  pure subroutine check_phases(phases, error)
    real(dp), intent(in) :: phases(:)
    type(error_type), allocatable, intent(out) :: error
    logical :: sound

    sound = all(phases >= 0 .and. phases <= 1)
    if (sound .and. size(phases) > 1) sound = all(phases(2:) >= phases(:size(phases) - 1))
    if (.not. sound) call fatal_error(error, "phases must be ascending and lie between 0 and 1", invalid_input)
  end subroutine check_phases

  !> Fails if there are fewer than two nodes, if the nodes are not ascending phases, or if one of the array lengths `sizes` is
  !> not `n`.
  pure subroutine check_shapes(n, nodes, sizes, error)
    integer, intent(in) :: n, sizes(:)
    real(dp), intent(in) :: nodes(:)
    type(error_type), allocatable, intent(out) :: error

    call check_phases(nodes, error)
    if (allocated(error)) return
    if (size(nodes) < 2) then
      call fatal_error(error, "the number of steps of a motion must be 1 or more", invalid_input)
    else if (any(sizes /= n)) then
      call fatal_error(error, "units and results must have one element per state: " // text(n), invalid_input)
    end if
  end subroutine check_shapes

  !> Computes Phi(T) = A_m ... A_1 from the maps of the steps between `nodes`; this is equation (17) of the paper that
  !> doc/theory.md names. Fails if nodes or shapes are invalid, a step fails, or a number overflows.
  subroutine period_map(system, method, nodes, scale, phi, error, xp, xp_peak, transient_growth, lower, unresolved, &
    & segments)
    class(periodic_system), intent(in) :: system
    class(method_type), intent(in) :: method
    !> `nodes`: ends of the steps, as phases. `scale`: units of the states, shape (n).
    real(dp), contiguous, intent(in) :: nodes(:), scale(:)
    !> Phi(T), shape (n, n)
    real(dp), intent(out) :: phi(:, :)
    type(error_type), allocatable, intent(out) :: error
    !> `xp`: x_p(T) of the motion that starts from zero, shape (n). `xp_peak`: largest norm of x_p / scale. `transient_growth`:
    !> growth of a rounding error, |Phi(T, t)| |Phi(t)| / |Phi(T)|, at least 1. It is computed where Phi(t) is largest and at half
    !> of the period; the larger value is returned.
    real(dp), intent(out), optional :: xp(:), xp_peak, transient_growth
    !> Maps of the period by the two embedded methods, shape (2)
    type(period_map_type), intent(out), optional :: lower(:)
    !> Effects of variations of the coefficients and loads between the nodes, summed over the steps
    type(unresolved_type), intent(out), optional :: unresolved
    !> Maps of segments of the period, whose ends are ends of steps; computed only together with `xp`
    type(segments_type), intent(inout), optional :: segments
    real(dp), allocatable :: maps(:, :, :), low(:, :, :, :)
    ! An unallocated variable counts as an absent argument.
    type(transient_type), allocatable :: transient
    integer :: n, columns, room, first, last, i
    logical :: fits, divides

    n = system%states
    call check_shapes(n, nodes, [size(scale), shape(phi)], error)
    if (allocated(error)) return
    columns = n
    if (present(xp)) columns = n + 1
    room = min(block_length, size(nodes) - 1)
    allocate(maps(room, n, columns))
    phi = unit_matrix(n)
    if (present(lower)) then
      allocate(low(room, n, columns, size(lower)))
      do i = 1, size(lower)
        allocate(lower(i)%phi, source=phi)
        if (present(xp)) allocate(lower(i)%xp(n), source=0.0_dp)
      end do
    end if
    if (present(xp)) xp = 0
    if (present(xp_peak)) xp_peak = 0
    if (present(transient_growth)) transient = transient_type(peak=phi, halfway=phi, peak_norm=sqrt(real(n, dp)), &
      & middle=(size(nodes) - 1) / 2)

    divides = present(segments) .and. present(xp)
    if (divides) call start_segments(n, nodes, segments)

    last = 0
    do while (last < size(nodes) - 1)
      first = last + 1
      last = end_of_block(first, size(nodes) - 1)
      associate (from => nodes(first:last), to => nodes(first + 1:last + 1), steps => last - first + 1)
        if (present(lower)) then
          call method%pair(system, from, to, maps, error, low, unresolved)
        else
          call method%maps(system, from, to, maps, error)
        end if
        if (allocated(error)) return
        call multiply_maps(steps, maps, scale, phi, fits, xp, xp_peak, transient)
        if (present(lower)) then
          do i = 1, size(lower)
            if (fits) call multiply_maps(steps, low(:, :, :, i), scale, lower(i)%phi, fits, lower(i)%xp)
          end do
        end if
        if (divides .and. fits) call extend_segments(first, last, size(nodes) - 1, maps, segments, fits)
      end associate
      if (.not. fits) then
        call overflow(error)
        return
      end if
    end do
    if (present(transient_growth)) transient_growth = max(growth_by(balanced(phi, scale), balanced(transient%peak, scale), &
      & transient%peak_norm), growth_halfway(balanced(phi, scale), balanced(transient%halfway, scale)))
  end subroutine period_map

  !> Divides the period into segments of about equal numbers of steps. Each map begins as the unit matrix.
  pure subroutine start_segments(n, nodes, segments)
    integer, intent(in) :: n
    real(dp), intent(in) :: nodes(:)
    type(segments_type), intent(out) :: segments
    integer :: count, k

    ! Within a segment a bound on its rate takes the place of the map: where vibrations are fast, segments must be short.
    count = min(max(min_segments, (size(nodes) - 1) / 8), max_segments, size(nodes) - 1)
    allocate(segments%ends(0:count), segments%maps(n, n, count))
    segments%ends = [(nodes(1 + last_step(k, count, size(nodes) - 1)), k = 0, count)]
    do k = 1, count
      segments%maps(:, :, k) = unit_matrix(n)
    end do
  end subroutine start_segments

  !> Number of the last step of segment k of `count` segments
  pure integer function last_step(k, count, steps)
    integer, intent(in) :: k, count, steps

    last_step = (k * steps) / count
  end function last_step

  !> Multiplies the maps of the segments by the maps of the steps `first` to `last`. `fits` is false if a number overflows.
  pure subroutine extend_segments(first, last, steps, maps, segments, fits)
    integer, intent(in) :: first, last, steps
    real(dp), contiguous, intent(in) :: maps(:, :, :)
    type(segments_type), intent(inout) :: segments
    logical, intent(out) :: fits
    integer :: k, from, to

    fits = .true.
    do k = 1, size(segments%maps, 3)
      from = max(first, last_step(k - 1, size(segments%maps, 3), steps) + 1)
      to = min(last, last_step(k, size(segments%maps, 3), steps))
      if (from > to) cycle
      call follow_maps(from - first + 1, to - from + 1, maps, segments%maps(:, :, k), fits)
      if (.not. fits) return
    end do
  end subroutine extend_segments

  !> Growth, relative to Phi(T), of a rounding error made at the peak, where Phi(t) is largest. An error made at the peak is
  !> multiplied by Phi(T) Phi(t)^-1 until the end of the period. If Phi does not fall after the peak, the growth is about 1 and is
  !> not computed.
  real(dp) function growth_by(phi, peak, peak_norm) result(growth)
    real(dp), intent(in) :: phi(:, :), peak(:, :), peak_norm
    real(dp), parameter :: much = 10
    real(dp), allocatable :: back(:, :)
    type(error_type), allocatable :: singular
    real(dp) :: norm

    norm = norm2(phi)
    growth = 1
    if (peak_norm < much * max(norm, sqrt(real(size(phi, 1), dp)))) return
    call inverse(peak, back, singular)
    if (allocated(singular)) then
      growth = peak_norm / max(norm, tiny(norm))
    else
      growth = max(1.0_dp, norm2(matmul(phi, back)) * peak_norm / max(norm, tiny(norm)))
    end if
  end function growth_by

  !> Growth of a rounding error made at half of the period: |Phi(T, t)| |Phi(t)| / |Phi(T)|, divided by its value for rotations. It
  !> is far above 1 where nearly coincident modes decay, as at critical damping. It is set to 1 where Phi(t) is nearly singular.
  real(dp) function growth_halfway(phi, halfway) result(growth)
    real(dp), intent(in) :: phi(:, :), halfway(:, :)
    real(dp), parameter :: max_spread = 1.0e12_dp
    real(dp), allocatable :: back(:, :)
    type(error_type), allocatable :: singular
    real(dp) :: norm

    growth = 1
    norm = norm2(halfway)
    if (.not. norm > tiny(norm)) return
    call inverse(halfway / norm, back, singular)
    if (allocated(singular)) return
    if (.not. norm2(back) < max_spread) return
    growth = max(1.0_dp, norm2(matmul(phi, back)) / (sqrt(real(size(phi, 1), dp)) * max(norm2(phi), tiny(1.0_dp))))
  end function growth_halfway

  !> Computes the motion x that starts from `x0` at phase 0. All phases are ends of steps, and no step is longer than the steps
  !> between `nodes`. x therefore has the accuracy of the method at the phases. Fails in the cases in which `period_map` fails,
  !> and if `x` does not have one column per phase.
  subroutine trajectory(system, method, nodes, x0, phases, x, error)
    class(periodic_system), intent(in) :: system
    class(method_type), intent(in) :: method
    !> `nodes`: ends of the steps, as phases. `x0`: initial state, shape (n). `phases`: phases in [0, 1], ascending.
    real(dp), intent(in) :: nodes(:), x0(:), phases(:)
    !> Motion at the phases, shape (n, phases)
    real(dp), intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: maps(:, :, :), all_nodes(:)
    real(dp) :: now(size(x0))
    integer :: n, k, first, last, next

    call check_shapes(system%states, nodes, [size(x0), size(x, 1)], error)
    if (.not. allocated(error)) call check_phases(phases, error)
    if (allocated(error)) return
    if (size(x, 2) /= size(phases)) then
      call fatal_error(error, "the array of the motion must have one column per phase", invalid_input)
      return
    end if
    all_nodes = refined(system, nodes, phases)
    n = size(x0)
    allocate(maps(block_length, n, n + 1))
    now = x0
    next = 1
    call keep(all_nodes(1))
    last = 0
    do while (last < size(all_nodes) - 1)
      first = last + 1
      last = end_of_block(first, size(all_nodes) - 1)
      associate (from => all_nodes(first:last), to => all_nodes(first + 1:last + 1))
        call method%maps(system, from, to, maps, error)
        if (allocated(error)) return
        do k = 1, size(from)
          now = matmul(maps(k, :, :n), now) + maps(k, :, n + 1)
          call keep(to(k))
        end do
      end associate
    end do
    if (.not. all(ieee_is_finite(x))) call overflow(error)

  contains

    subroutine keep(phase)
      real(dp), intent(in) :: phase

      do while (next <= size(phases))
        if (phases(next) > phase) return
        x(:, next) = now
        next = next + 1
      end do
    end subroutine keep

  end subroutine trajectory

  !> Divides the period into `parts` equal parts. Computes the maps from the start of each part to equidistant phases in it.
  !> Fails if a step fails or a number overflows.
  subroutine motions(system, method, nodes, parts, maps, error)
    class(periodic_system), intent(in) :: system
    class(method_type), intent(in) :: method
    !> Ends of equal steps, as phases; they must include all phases k / count to which `maps` refers
    real(dp), contiguous, intent(in) :: nodes(:)
    !> Number of equal parts of the period
    integer, intent(in) :: parts
    !> Maps [Phi(t) x_p(t)], shape (n, n + 1, count), or Phi(t) alone, shape (n, n, count), from the start of each part to the
    !> phases k / count, k = 1 ... count
    real(dp), intent(out) :: maps(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: of_steps(:, :, :)
    !> [E 0]
    real(dp), dimension(size(maps, 1), size(maps, 2)) :: start, now
    integer :: n, steps, every, in_part, first, last, count, k
    logical :: fits

    n = system%states
    steps = size(nodes) - 1
    every = steps / size(maps, 3)
    in_part = every * (size(maps, 3) / parts)
    allocate(of_steps(min(block_length, steps), n, size(maps, 2)))
    start = 0
    start(:, :n) = unit_matrix(n)
    last = 0
    do while (last < steps)
      first = last + 1
      last = end_of_block(first, steps)
      call method%maps(system, nodes(first:last), nodes(first + 1:last + 1), of_steps, error)
      if (allocated(error)) return
      k = first - 1
      do while (k < last)
        if (mod(k, in_part) == 0) now = start
        count = min(every - mod(k, every), last - k)
        call follow_maps(k - first + 2, count, of_steps, now, fits)
        if (.not. fits) then
          call overflow(error)
          return
        end if
        k = k + count
        if (mod(k, every) == 0) maps(:, :, k / every) = now
      end do
    end do
  end subroutine motions

  !> Reports overflow.
  pure subroutine overflow(error)
    type(error_type), allocatable, intent(out) :: error

    call fatal_error(error, "a free vibration overflows double precision within one period", failed_computation)
  end subroutine overflow

end module gestell_floquet_period_period_map

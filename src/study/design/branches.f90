!> Computes measures of periodic functions (peak or rms) as the maximum of several smooth functions, called branches, with
!> derivatives. A peak has one branch for every local maximum over the turn. By the envelope theorem its derivative may be taken
!> at the fixed phase of the maximum. An rms value has one branch. An rms value within a frequency band has one branch for each
!> direction that is considered.
module gestell_study_design_branches
  use gestell_base_kinds, only: dp, pi
  use gestell_math_series_trigonometric, only: series_through, series_type
  use gestell_study_measure, only: peak_measure, rms_measure
  implicit none (type, external)
  private

  public :: maxima_over_turn, measure_branches

  !> `counts`: a local maximum below this fraction of the largest one gets no branch. `near`: a sample above this fraction of the
  !> largest maximum gets a branch.
  real(dp), parameter :: counts = 0.3_dp, near = 0.95_dp
  !> Number of steps of Newton's method for the phase of a maximum.
  integer, parameter :: iterations = 6

contains

  !> Computes the branches of a measure (peak, rms or rms within a band), and their derivatives.
  pure subroutine measure_branches(kind, band, period, samples, slopes, values, changes)
    !> Kind of the measure (gestell_study_measure)
    integer, intent(in) :: kind
    !> `band`: lower and upper limit of the frequency band (Hz). `period`: period (s). `samples`: components of the function over
    !> the turn, shape (samples, components). `slopes`: derivatives of the samples with respect to the parameters, shape (samples,
    !> components, parameters)
    real(dp), intent(in) :: band(2), period, samples(:, :), slopes(:, :, :)
    !> `values`: values of the branches, shape (branches). `changes`: their derivatives, shape (parameters, branches)
    real(dp), allocatable, intent(out) :: values(:), changes(:, :)
    real(dp) :: unit
    integer :: k

    unit = maxval(abs(samples))
    if (.not. unit > 0) then
      values = [0.0_dp]
      allocate(changes(size(slopes, 3), 1), source=0.0_dp)
    else if (kind == peak_measure) then
      call find_tops(samples / unit, slopes / unit, values, changes)
    else if (kind == rms_measure) then
      values = [norm2(samples / unit) / sqrt(real(size(samples, 1), dp))]
      allocate(changes(size(slopes, 3), 1))
      changes(:, 1) = [(sum(samples / unit * slopes(:, :, k) / unit) / size(samples, 1) / values(1), k = 1, size(slopes, 3))]
    else
      call within_band(band, period, samples / unit, slopes / unit, values, changes)
      unit = 1000 * unit ! a vibration meter displays mm/s
    end if
    values = unit * values
    changes = unit * changes
  end subroutine measure_branches

  !> Computes a branch for every local maximum over the turn of the magnitude of a vector y, and for the samples close to the
  !> largest maximum. If the magnitude hardly changes over the turn, its maximum jumps between these samples.
  pure subroutine find_tops(samples, slopes, values, changes)
    real(dp), intent(in) :: samples(:, :), slopes(:, :, :)
    real(dp), allocatable, intent(out) :: values(:), changes(:, :)
    type(series_type) :: change
    real(dp) :: square(size(samples, 1))
    real(dp), allocatable :: places(:), sizes(:), y(:, :), s(:, :), unused(:, :), also_unused(:, :)
    integer, allocatable :: high(:)
    integer :: i, k, n

    n = size(samples, 1)
    square = sum(samples**2, dim=2)
    call maxima_over_turn(samples, places, sizes, y)
    high = pack([(i, i = 1, n)], square >= near**2 * maxval(square))
    values = [sizes, sqrt(square(high))]
    allocate(changes(size(slopes, 3), size(values)))
    change = series_through(reshape(slopes, [n, size(samples, 2) * size(slopes, 3)]))
    allocate(s(size(places), size(samples, 2) * size(slopes, 3)))
    allocate(unused, also_unused, mold=s)
    call change%values(places, s, unused, also_unused)
    do k = 1, size(slopes, 3)
      associate (m => size(places), c => size(samples, 2))
        changes(k, :m) = sum(y * s(:, (k - 1) * c + 1:k * c), dim=2) / sizes
        changes(k, m + 1:) = sum(samples(high, :) * slopes(high, :, k), dim=2) / sqrt(square(high))
      end associate
    end do
  end subroutine find_tops

  !> Finds every local maximum over the turn of the magnitude of a vector y. At a maximum y . y' = 0. Newton's method computes its
  !> phase, starting from the samples that are larger than their neighbours.
  pure subroutine maxima_over_turn(samples, places, sizes, y)
    !> The vector y at equidistant phases, shape (samples, components)
    real(dp), intent(in) :: samples(:, :)
    !> Phases (turns) and magnitudes of the maxima, both of shape (maxima), and y at the maxima, shape (maxima, components)
    real(dp), allocatable, intent(out) :: places(:), sizes(:), y(:, :)
    type(series_type) :: along
    real(dp), dimension(1, size(samples, 2)) :: at, at_d, at_dd
    real(dp) :: square(size(samples, 1)), bend, start
    integer :: i, n, iteration

    n = size(samples, 1)
    square = sum(samples**2, dim=2)
    places = pack([(real(i, dp) / n, i = 0, n - 1)], square >= cshift(square, 1) .and. square > cshift(square, -1) &
      & .and. square >= counts**2 * maxval(square))
    along = series_through(samples)
    allocate(sizes(size(places)), y(size(places), size(samples, 2)))
    do i = 1, size(places)
      start = places(i)
      do iteration = 1, iterations
        call along%values(places(i:i), at, at_d, at_dd)
        bend = sum(at_d**2 + at * at_dd)
        if (.not. bend < 0) exit
        places(i) = min(max(places(i) - sum(at * at_d) / bend / (2 * pi), start - 1.0_dp / n), start + 1.0_dp / n)
      end do
      call along%values(places(i:i), at, at_d, at_dd)
      y(i, :) = at(1, :)
      sizes(i) = norm2(at)
    end do
  end subroutine maxima_over_turn

  !> Computes the rms within the frequency band in the direction in which it is largest (gestell_study_vibration_statistics). Its
  !> square is the largest eigenvalue of a matrix: the mean of y y^T over the orders in the band. Each branch is the rms of u^T y
  !> in one direction u. Several fixed directions are used in addition to the eigenvector, because the eigenvector jumps where two
  !> eigenvalues are equal.
  pure subroutine within_band(band, period, samples, slopes, values, changes)
    real(dp), intent(in) :: band(2), period, samples(:, :), slopes(:, :, :)
    real(dp), allocatable, intent(out) :: values(:), changes(:, :)
    real(dp), parameter :: rounding = 1.0e-12_dp
    type(series_type) :: along, change
    real(dp), dimension(size(samples, 2), size(samples, 2)) :: square, slope
    real(dp), allocatable :: u(:, :)
    integer :: d, k, first, last

    along = series_through(samples)
    first = max(1, ceiling(band(1) * period * (1 - rounding)))
    last = min(ubound(along%cosine, 1), floor(min(band(2) * period * (1 + rounding), 1.0e9_dp)))
    call add_orders(along, along, first, last, square)
    u = directions_about(square)
    values = [(sqrt(max(dot_product(u(:, d), matmul(square, u(:, d))), 0.0_dp)), d = 1, size(u, 2))]
    allocate(changes(size(slopes, 3), size(values)), source=0.0_dp)
    do k = 1, size(slopes, 3)
      change = series_through(slopes(:, :, k))
      call add_orders(along, change, first, last, slope)
      do d = 1, size(values)
        if (values(d) > 0) changes(k, d) = dot_product(u(:, d), matmul(slope, u(:, d))) / values(d)
      end do
    end do
  end subroutine within_band

  !> Directions in which the mean square is evaluated, shape (components, directions): the eigenvector of the largest eigenvalue
  !> of the symmetric matrix `square`, and fixed directions distributed over all angles.
  pure function directions_about(square) result(u)
    real(dp), intent(in) :: square(:, :)
    real(dp), allocatable :: u(:, :)
    integer, parameter :: around = 12, iterations = 200
    !> Directions from the centre of a cube to its faces, edges and corners, one of each pair of opposite directions.
    integer, parameter :: cube(3, 13) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0, 1, -1, 0, 1, 0, 1, 1, 0, -1, 0, 1, 1, &
      & 0, 1, -1, 1, 1, 1, 1, 1, -1, 1, -1, 1, 1, -1, -1], [3, 13])
    real(dp) :: v(3), angles(around + 1), most
    integer :: d

    select case (size(square, 1))
    case (1)
      u = reshape([1.0_dp], [1, 1])
    case (2)
      angles = [atan2(2 * square(1, 2), square(1, 1) - square(2, 2)) / 2, (pi * d / around, d = 1, around)]
      allocate(u(2, size(angles)))
      u(1, :) = cos(angles)
      u(2, :) = sin(angles)
    case default
      allocate(u(3, size(cube, 2) + 1))
      most = -1
      do d = 1, size(cube, 2)
        v = cube(:, d)
        v = v / norm2(v)
        u(:, d + 1) = v
        if (dot_product(v, matmul(square, v)) > most) u(:, 1) = v
        most = max(most, dot_product(v, matmul(square, v)))
      end do
      do d = 1, iterations
        v = matmul(square, u(:, 1))
        if (.not. norm2(v) > 0) exit
        u(:, 1) = v / norm2(v)
      end do
    end select
  end function directions_about

  !> Computes the mean of y z^T over the period. Only the orders `first` to `last` of the series y and z are included.
  pure subroutine add_orders(y, z, first, last, mean)
    type(series_type), intent(in) :: y, z
    integer, intent(in) :: first, last
    real(dp), intent(out) :: mean(:, :)
    integer :: i, j

    mean = 0
    do j = 1, size(z%cosine, 2)
      do i = 1, size(y%cosine, 2)
        mean(i, j) = (dot_product(y%cosine(first:last, i), z%cosine(first:last, j)) &
          & + dot_product(y%sine(first:last, i), z%sine(first:last, j))) / 2
      end do
    end do
  end subroutine add_orders

end module gestell_study_design_branches

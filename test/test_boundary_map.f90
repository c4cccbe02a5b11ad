!> Stability borders in the plane of two parameters against known curves.
module test_boundary_map
  use boundary_families, only: height_family, machine_family, mathieu_family, new_machine_family
  use boundary_oracles, only: characteristic_values, mathieu_trace
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_task_boundary_map, only: border_map_type, border_vertex_type, trace_borders
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type, grid_type
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_boundary_map

contains

  subroutine collect_boundary_map(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("a circular border is closed, within tolerance, unstable outside", test_circle), &
      & new_unittest("the unstable side remains on the left if ranges descend", test_descending), &
      & new_unittest("two separate circular borders are both found", test_circles), &
      & new_unittest("a circle that leaves the ranges ends on their edges", test_cut), &
      & new_unittest("both pairs of hyperbola branches near a saddle are found", test_saddle), &
      & new_unittest("eight straight borders that cross one search cell are found", test_stripes), &
      & new_unittest("a border ends at the edge of a region without systems", test_hole), &
      & new_unittest("a strip of unsolvable systems yields no curve and is reported as open", test_unsolvable_strip), &
      & new_unittest("a border has a corner where divergence changes to flutter", test_corner), &
      & new_unittest("a hyperbola on logarithmic axes is followed as a straight line", test_logarithmic), &
      & new_slow("every vertex of Mathieu's stability diagram lies on a characteristic curve", test_mathieu), &
      & new_slow("tongues of weakly damped Mathieu's diagram between search lines are found", test_narrow), &
      & new_slow("two search grids yield the same diagram of damped Mathieu's equation", test_tongues)]
  end subroutine collect_boundary_map

  subroutine trace(family, axes, deviation, map, error)
    class(family_type), intent(in) :: family
    type(axis_type), intent(in) :: axes(2)
    real(dp), intent(in) :: deviation
    type(border_map_type), intent(out) :: map
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call trace_borders(family, grid_type(axes), accuracy_type(tolerance=1.0e-11_dp), deviation, map, failure)
    call check_success(error, failure)
  end subroutine trace

  !> True if curve `number` ends where it begins.
  pure logical function closed(map, number)
    type(border_map_type), intent(in) :: map
    integer, intent(in) :: number

    closed = all(abs(map%vertices(findloc(map%vertices%curve, number, dim=1))%parameters &
      & - map%vertices(findloc(map%vertices%curve, number, dim=1, back=.true.))%parameters) <= 0)
  end function closed

  !> Points of all curves, 20 on the way from each vertex to the next.
  pure function along(map) result(points)
    type(border_map_type), intent(in) :: map
    real(dp), allocatable :: points(:, :)
    integer, parameter :: parts = 20
    integer :: i, k, n

    allocate(points(2, parts * size(map%vertices)))
    n = 0
    do i = 1, size(map%vertices) - 1
      associate (v => map%vertices(i), w => map%vertices(i + 1))
        if (v%curve /= w%curve) cycle
        do k = 0, parts
          n = n + 1
          points(:, n) = v%parameters + (w%parameters - v%parameters) * k / parts
          if (k == parts) n = n - 1
        end do
      end associate
    end do
    points = points(:, :n)
  end function along

  !> Stable if the first parameter is below 1.7, unstable above 2.3; the systems in between cannot be solved. Every line along
  !> the first axis lists the strip as open; a line along the second axis is open as a whole if it lies in the strip.
  subroutine test_unsolvable_strip(error)
    type(error_type), allocatable, intent(out) :: error
    type(axis_type), parameter :: axes(2) = [axis_type(0.0_dp, 4.0_dp, 5), axis_type(-1.0_dp, 3.0_dp, 4)]
    type(border_map_type) :: map
    real(dp), allocatable :: levels(:), low(:), high(:)
    integer :: i, k

    call trace(height_family(kind="lost"), axes, 1.0e-3_dp, map, error)
    if (allocated(error)) return
    call check_that(error, map%curves, "==", 0, "curves")
    if (allocated(error)) return
    allocate(levels(0), low(0), high(0))
    do i = 1, size(map%places)
      associate (at => map%places(i)%parameters, width => map%places(i)%width(1))
        if (map%places(i)%width(2) > 0) then
          call check_that(error, abs(at(1) - 2), "<", 0.3_dp, "a line along the second axis within the strip")
          call check_that(error, map%places(i)%width(2), "==", axes(2)%to - axes(2)%from, "its width")
          cycle
        end if
        k = findloc(abs(levels - at(2)) <= 0, .true., dim=1)
        if (k == 0) then
          levels = [levels, at(2)]
          low = [low, at(1) - width / 2]
          high = [high, at(1) + width / 2]
        else
          low(k) = min(low(k), at(1) - width / 2)
          high(k) = max(high(k), at(1) + width / 2)
        end if
      end associate
    end do
    call check_that(error, size(levels), "==", axes(2)%count, "lines with an open strip")
    call check_that(error, [minval(levels), maxval(levels)], "==", [axes(2)%from, axes(2)%to], "first and last line")
    ! The search halves the intervals at the strip's edges until they are 1e-3 of the range.
    call check_that(error, abs(low - 1.7_dp), "<", 0.02_dp, "from")
    call check_that(error, abs(high - 2.3_dp), "<", 0.02_dp, "to")
  end subroutine test_unsolvable_strip

  subroutine test_circle(error)
    type(error_type), allocatable, intent(out) :: error
    type(axis_type), parameter :: axis = axis_type(-2.0_dp, 2.0_dp, 9)
    type(border_map_type) :: map
    real(dp), allocatable :: points(:, :)
    integer :: i

    call trace(height_family(), [axis, axis], 1.0e-4_dp, map, error)
    if (allocated(error)) return
    call check_that(error, map%curves, "==", 1, "curves")
    call check_that(error, map%rough, "==", 0, "rough")
    call check_that(error, closed(map, 1), "==", .true., "first curve closed")
    if (allocated(error)) return
    points = along(map)
    ! 1e-4 of the range 4; measured at three parts of each way, a circle deviates most at the middle one.
    call check_that(error, maxval(abs(norm2(points, dim=1) - 1)), "<", 4.0e-4_dp, "deviation")
    ! A hundredth of that at the vertices.
    call check_that(error, [(abs(norm2(map%vertices(i)%parameters) - 1), i = 1, size(map%vertices))], "<", 4.0e-6_dp, &
      & "vertices on the circle")
    if (allocated(error)) return
    ! The unstable outside is on the left, so the curve runs clockwise. The area differs from the circle's by less than 2 pi
    ! times the deviation.
    call check(error, area(map), -acos(-1.0_dp), thr=2.6e-3_dp)
    if (allocated(error)) return
    ! No more vertices than necessary: chords of angle sqrt(8 deviation), and half of that.
    call check_that(error, size(map%vertices), "<", 300, "vertices")
  end subroutine test_circle

  !> Area that the curves enclose, positive where they run counter-clockwise.
  pure real(dp) function area(map)
    type(border_map_type), intent(in) :: map
    integer :: i

    area = 0
    do i = 2, size(map%vertices)
      associate (v => map%vertices(i - 1), w => map%vertices(i))
        if (v%curve == w%curve) area = area + (v%parameters(1) * w%parameters(2) - v%parameters(2) * w%parameters(1)) / 2
      end associate
    end do
  end function area

  !> If one range descends, the plane is mirrored; if both do, it is not. The unstable side, outside the circles, remains on the
  !> left.
  subroutine test_descending(error)
    type(error_type), allocatable, intent(out) :: error
    type(axis_type), parameter :: up(2) = [axis_type(-3.0_dp, 3.0_dp, 9), axis_type(-2.0_dp, 2.0_dp, 9)], &
      & down(2) = [axis_type(3.0_dp, -3.0_dp, 9), axis_type(2.0_dp, -2.0_dp, 9)]
    type(border_map_type) :: map
    integer :: k

    do k = 1, 3
      call trace(height_family(kind="circles"), [merge(up(1), down(1), k == 2), merge(up(2), down(2), k == 1)], 1.0e-3_dp, &
        & map, error)
      if (allocated(error)) return
      call check_that(error, map%curves, "==", 2, "curves")
      call check_that(error, closed(map, 1), "==", .true., "first curve closed")
      call check_that(error, closed(map, 2), "==", .true., "second curve closed")
      if (allocated(error)) return
      ! Two circumferences of 2 pi times the deviation, 1e-3 of 6.
      call check(error, area(map), -2 * acos(-1.0_dp), thr=0.08_dp)
      if (allocated(error)) return
    end do
  end subroutine test_descending

  subroutine test_circles(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_map_type) :: map

    call trace(height_family(kind="circles"), [axis_type(-3.0_dp, 3.0_dp, 9), axis_type(-2.0_dp, 2.0_dp, 9)], 1.0e-3_dp, &
      & map, error)
    if (allocated(error)) return
    call check(error, map%curves, 2)
    if (allocated(error)) return
    call check_that(error, [closed(map, 1), closed(map, 2)], "==", [.true., .true.], "closed")
  end subroutine test_circles

  subroutine test_cut(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_map_type) :: map
    integer :: n

    call trace(height_family(), [axis_type(-2.0_dp, 2.0_dp, 9), axis_type(0.3_dp, 2.0_dp, 7)], 1.0e-3_dp, map, error)
    if (allocated(error)) return
    call check(error, map%curves, 1)
    if (allocated(error)) return
    n = size(map%vertices)
    ! On the edge p2 = 0.3; a hundredth of the deviation times the range.
    call check(error, map%vertices(1)%parameters(1), -sqrt(0.91_dp), thr=4.0e-5_dp)
    if (allocated(error)) return
    call check(error, map%vertices(n)%parameters(1), sqrt(0.91_dp), thr=4.0e-5_dp)
    if (allocated(error)) return
    call check_that(error, maxval(abs([map%vertices(1)%parameters(2), map%vertices(n)%parameters(2)] - 0.3_dp)), "<=", 0.0_dp, &
      & "ends on the line")
  end subroutine test_cut

  !> p1 p2 = +-1e-3: two branches, in opposite quadrants each time, closer than the search grid's lines.
  subroutine test_saddle(error)
    type(error_type), allocatable, intent(out) :: error
    type(axis_type), parameter :: axis = axis_type(-1.0_dp, 1.0_dp, 7)
    type(border_map_type) :: map
    real(dp), allocatable :: points(:, :)
    integer :: i, side

    do i = 1, 2
      side = 2 * i - 3
      call trace(height_family(kind="saddle", offset=side * 1.0e-3_dp), [axis, axis], 1.0e-3_dp, map, error)
      if (allocated(error)) return
      call check(error, map%curves, 2)
      if (allocated(error)) return
      points = along(map)
      call check_that(error, side * points(1, :) * points(2, :), ">", 0.0_dp, "never into the other quadrants")
      ! Distance from the hyperbola |p1 p2| = 1e-3: at most the change of p1 p2 over the gradient. 1e-3 of the range 2.
      call check_that(error, maxval(abs(abs(points(1, :) * points(2, :)) - 1.0e-3_dp) / norm2(points, dim=1)), "<", 2.0e-3_dp, &
        & "points on the hyperbola")
      if (allocated(error)) return
    end do
  end subroutine test_saddle

  !> Straight lines p1 + p2 / 4 = const., from one edge to another, six or more through every cell.
  subroutine test_stripes(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: pi = acos(-1.0_dp)
    type(border_map_type) :: map
    real(dp) :: phase
    integer :: i

    call trace(height_family(kind="stripes"), [axis_type(0.05_dp, 5.9_dp, 3), axis_type(0.0_dp, 1.0_dp, 2)], 1.0e-3_dp, map, error)
    if (allocated(error)) return
    ! p1 + p2 / 4 = 0.2, 0.8, 1.2, ... 5.2, 5.8.
    call check(error, map%curves, 12)
    if (allocated(error)) return
    do i = 1, size(map%vertices)
      associate (v => map%vertices(i))
        phase = v%parameters(1) + v%parameters(2) / 4
        phase = abs(phase - nint(phase)) - acos(0.3_dp) / (2 * pi)
        ! The range 6 times the exactness of lines, 1e-8.
        call check_that(error, abs(phase), "<", 1.2e-7_dp, "on a line")
        if (allocated(error)) return
        if (i == 1) cycle
        if (map%vertices(i - 1)%curve /= v%curve) cycle
        associate (w => map%vertices(i - 1)%parameters - v%parameters)
          call check_that(error, abs(w(1) + w(2) / 4), "<", 1.2e-7_dp, "along the line")
        end associate
        if (allocated(error)) return
      end associate
    end do
  end subroutine test_stripes

  !> The circle outside the hole: one curve that ends at the hole, to the size of the divided cells.
  subroutine test_hole(error)
    type(error_type), allocatable, intent(out) :: error
    type(axis_type), parameter :: axis = axis_type(-2.0_dp, 2.0_dp, 9)
    type(border_map_type) :: map
    real(dp) :: from_hole(2)
    integer :: n

    call trace(height_family(kind="hole"), [axis, axis], 1.0e-3_dp, map, error)
    if (allocated(error)) return
    call check(error, map%curves, 1)
    if (allocated(error)) return
    n = size(map%vertices)
    from_hole = [norm2(map%vertices(1)%parameters - [1, 0]), norm2(map%vertices(n)%parameters - [1, 0])] - 0.4_dp
    ! Two cells of the size of the deviation, 4e-3.
    call check_that(error, from_hole, ">=", 0.0_dp, "distance from the hole")
    call check_that(error, from_hole, "<", 0.012_dp, "distance from the hole")
  end subroutine test_hole

  !> Divergence at p1 = 0 for p2 < 0, flutter at p2 = 0 for p1 < 0.
  subroutine test_corner(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_map_type) :: map
    type(border_vertex_type) :: v
    real(dp) :: nearest(2)
    integer :: i

    call trace(height_family(kind="corner"), [axis_type(-1.0_dp, 1.2_dp, 8), axis_type(-1.0_dp, 1.1_dp, 7)], 1.0e-3_dp, map, error)
    if (allocated(error)) return
    call check(error, map%curves, 1)
    if (allocated(error)) return
    nearest = 1
    do i = 1, size(map%vertices)
      v = map%vertices(i)
      if (v%kind == "divergence") then
        ! A hundredth of the deviation times the ranges.
        call check_that(error, abs(v%parameters(1)), "<", 3.0e-5_dp, "p1 on the axis")
        call check_that(error, v%parameters(2), "<", 3.0e-5_dp, "p2")
        call check_that(error, abs(v%arg_rad), "<=", 0.0_dp, "argument")
        nearest(1) = min(nearest(1), norm2(v%parameters))
      else
        call check_that(error, abs(v%parameters(2)), "<", 3.0e-5_dp, "p2 on the axis")
        call check_that(error, v%parameters(1), "<", 3.0e-5_dp, "p1")
        call check_that(error, abs(v%arg_rad - 2), "<", 1.0e-9_dp, "argument")
        nearest(2) = min(nearest(2), norm2(v%parameters))
      end if
      if (allocated(error)) return
    end do
    ! The deviation times the ranges.
    call check_that(error, maxval(nearest), "<", 2.2e-3_dp, "distance of the corners")
  end subroutine test_corner

  !> p1 p2 = 1 is a straight line in the logarithms: only the points on the grid's lines are needed.
  subroutine test_logarithmic(error)
    type(error_type), allocatable, intent(out) :: error
    type(axis_type), parameter :: axis = axis_type(1.0e-2_dp, 1.0e2_dp, 6, .true.)
    type(border_map_type) :: map
    integer :: i

    call trace(height_family(kind="saddle", offset=1.0_dp), [axis, axis], 1.0e-3_dp, map, error)
    if (allocated(error)) return
    call check_that(error, map%curves, "==", 1, "curves")
    call check_that(error, size(map%vertices), "<=", 12, "vertices")
    ! A hundredth of the deviation times ln 1e4, in each of the two.
    call check_that(error, [(abs(log(product(map%vertices(i)%parameters))), i = 1, size(map%vertices))], "<", 2.0e-4_dp, &
      & "vertices on the hyperbola")
  end subroutine test_logarithmic

  subroutine test_mathieu(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_map_type) :: map
    real(dp), allocatable :: values(:)
    integer :: i

    call trace(mathieu_family(), [axis_type(-2.0_dp, 18.0_dp, 16), axis_type(0.0_dp, 8.0_dp, 9)], 1.0e-3_dp, map, error)
    if (allocated(error)) return
    ! a0, then b1 with a1, b2 with a2, b3 with a3, b4 with a4: the two sides of a tongue meet at its tip at q = 0.
    call check(error, map%curves, 5)
    if (allocated(error)) return
    do i = 1, size(map%vertices)
      associate (v => map%vertices(i))
        values = characteristic_values(v%parameters(2), v%kind == "period_doubling", 60.0_dp)
        ! A hundredth of the deviation in either direction: 2e-4 in a, 8e-5 in q with |da/dq| < 2.
        call check_that(error, minval(abs(values - v%parameters(1))), "<", 4.0e-4_dp, "on the curve")
        if (allocated(error)) return
      end associate
    end do
  end subroutine test_mathieu

  !> With y'' + 1e-3 y' + ... = 0 the tongues of a = 4, 9, 16 are 1e-6 to 1e-2 of the range wide where they begin, and no line
  !> of the search grid lies in them. y = exp(-d t/2) u makes it Mathieu's equation with a - d**2/4 in place of a: at a border
  !> abs(trace of Phi) = 2 cosh(d pi/2) of u.
  subroutine test_narrow(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: d = 1.0e-3_dp, pi = acos(-1.0_dp)
    type(border_map_type) :: map
    real(dp) :: excess(4)
    integer :: i, k

    call trace(mathieu_family(d=d), [axis_type(-2.0_dp, 18.0_dp, 5), axis_type(0.0_dp, 8.0_dp, 4)], 1.0e-3_dp, map, error)
    if (allocated(error)) return
    call check(error, map%curves, 5)
    if (allocated(error)) return
    call check(error, map%rough, 0, more="unrefined parts of the curves")
    if (allocated(error)) return
    do i = 1, size(map%vertices)
      associate (v => map%vertices(i))
        ! The border passes within the error of the vertex: not all corners of the square about it lie on one side.
        do k = 1, 4
          associate (corner => v%parameters + 1.01_dp * v%error * merge(1, -1, [k > 2, mod(k, 2) == 0]))
            excess(k) = real(abs(mathieu_trace(corner(1) - d**2 / 4, corner(2))) - 2 * cosh(d * pi / 2), dp)
          end associate
        end do
        call check_that(error, minval(excess), "<=", 0.0_dp, "both sides of a vertex")
        call check_that(error, maxval(excess), ">=", 0.0_dp, "both sides of a vertex")
        if (allocated(error)) return
      end associate
    end do
  end subroutine test_narrow

  !> With y'' + 0.6 y' + ... tongues begin at some q > 0, and those of rho = +1 and -1 overlap.
  subroutine test_tongues(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_map_type) :: map, finer
    integer :: i

    call trace(mathieu_family(d=0.6_dp), [axis_type(-2.0_dp, 12.0_dp, 12), axis_type(0.0_dp, 12.0_dp, 10)], 1.0e-3_dp, map, error)
    if (allocated(error)) return
    call trace(mathieu_family(d=0.6_dp), [axis_type(-2.0_dp, 12.0_dp, 30), axis_type(0.0_dp, 12.0_dp, 31)], 1.0e-3_dp, finer, &
      & error)
    if (allocated(error)) return
    call check(error, map%rough, 0)
    if (allocated(error)) return
    call check(error, map%curves, finer%curves)
    if (allocated(error)) return
    ! Each within the deviation of the other, measured at three parts of each way: half as much again for the rest of it.
    do i = 1, size(map%vertices)
      call check_that(error, distance(map%vertices(i)%parameters, finer), "<", 1.5e-3_dp, "from the finer one")
      if (allocated(error)) return
    end do
    do i = 1, size(finer%vertices)
      call check_that(error, distance(finer%vertices(i)%parameters, map), "<", 1.5e-3_dp, "from the coarser one")
      if (allocated(error)) return
    end do
  end subroutine test_tongues

  !> Distance of a point from the curves, relative to the ranges 14 and 12.
  pure real(dp) function distance(point, map)
    real(dp), intent(in) :: point(2)
    type(border_map_type), intent(in) :: map
    real(dp), parameter :: ranges(2) = [14, 12]
    real(dp) :: to_point(2), way(2), part
    integer :: i

    distance = huge(distance)
    do i = 1, size(map%vertices) - 1
      if (map%vertices(i)%curve /= map%vertices(i + 1)%curve) cycle
      to_point = (point - map%vertices(i)%parameters) / ranges
      way = (map%vertices(i + 1)%parameters - map%vertices(i)%parameters) / ranges
      part = dot_product(to_point, way) / max(dot_product(way, way), tiny(1.0_dp))
      distance = min(distance, norm2(to_point - min(max(part, 0.0_dp), 1.0_dp) * way))
    end do
  end function distance

end module test_boundary_map

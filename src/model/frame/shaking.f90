!> Shaking forces: the forces that mechanisms exert on a frame at rest if gravity is ignored. Moments are about the rest position
!> of the frame's centre of mass. Only the moments of the balance table (`shaking_in_space`) are about the origin of the
!> mechanisms.
module gestell_model_frame_shaking
  use gestell_base_kinds, only: dp
  use gestell_math_series_fourier, only: find_series, fourier_type
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_equations, only: set_load
  use gestell_model_mechanism, only: table_columns
  use gestell_model_mechanism_held, only: part_of_turn, tabulate_effective
  use gestell_model_mounting, only: in_space, is_rotation
  use gestell_math_rotation, only: cross
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: moment_point, shaking_in_space, shaking_loads, shaking_terms, turning_vectors

  !> Shaking forces of a frame in space over the period. Each component is f = mean + sum of amplitude(k) cos(k theta + phase(k)),
  !> with theta from 0 to 2 pi.
  type, public :: space_shaking_type
    !> The first three series are forces along xi, eta, zeta (N). The last three are moments about axes parallel to xi, eta, zeta
    !> through the origin O of the mechanisms (N m).
    type(fourier_type) :: series(6)
    !> For each component (N, N m). `peak`: maximum absolute value over the period. `rms`: rms value. `noise`: absolute value below
    !> which the component is only a rounding error.
    real(dp), dimension(6) :: peak = 0, rms = 0, noise = 0
    !> Direction of the shaft: the unit normal to the plane of the first mechanism.
    real(dp) :: shaft(3) = [0, 0, 1]
    !> The part of force and couple perpendicular to the shaft is the sum of two rotating vectors for each order. `force` (N),
    !> `couple` (N m): magnitudes of these vectors, shape (orders, 2). Column 1 rotates with the crank, column 2 against it.
    real(dp), allocatable :: force(:, :), couple(:, :)
  contains
    procedure :: is_finite
  end type space_shaking_type

contains

  !> True if no force overflows double precision.
  pure logical function is_finite(self)
    class(space_shaking_type), intent(in) :: self

    is_finite = all(ieee_is_finite(self%rms) .and. ieee_is_finite(self%peak))
  end function is_finite

  !> Computes the load h, linearised about rest and without gravity, for all degrees of freedom in the frame's order: forces (N)
  !> and moments (N m) about the rest position of the frame's centre of mass, shape (phases, dofs).
  subroutine shaking_loads(frame, phases, loads)
    class(frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), allocatable, intent(out) :: loads(:, :)
    real(dp) :: effective(size(phases), table_columns), forces(size(phases), 3)

    allocate(loads(size(phases), frame%dofs()))
    if (allocated(frame%space)) then
      call frame%space%shake(frame%speed, frame%crank_angles(phases), loads)
      loads = loads(:, in_space)
    else
      call tabulate_effective(frame%mechanism, frame%origin, frame%uniform_in_space(), frame%crank_angles(phases), effective, &
        & forces)
      call set_load([1, 2, 3], frame%speed, frame%origin, forces, loads)
    end if
  end subroutine shaking_loads

  !> Bounds on the sums of the absolute values of the terms of `shaking_loads`, shape (dofs). Where the terms cancel, digits are
  !> lost, because the load has the rounding errors of its terms.
  pure function shaking_terms(frame) result(terms)
    class(frame_type), intent(in) :: frame
    real(dp) :: terms(frame%dofs())
    real(dp) :: sums(2), even
    integer :: i

    even = part_of_turn(frame%mechanism, frame%uniform_in_space())
    if (allocated(frame%space)) then
      sums = frame%space%terms()
      sums(2) = sums(2) + even * sum([(frame%space%planes(i)%linkage%terms(4), i = 1, size(frame%space%planes))]) / 2
      terms = merge(sums(2), sums(1), is_rotation([(i, i = 1, 6)]))
    else
      associate (t => frame%mechanism%terms, origin => abs(frame%origin))
        terms = [t(1), t(2), origin(1) * t(2) + origin(2) * t(1) + t(3) + even * t(4) / 2]
      end associate
    end if
    terms = frame%speed**2 * terms
  end function shaking_terms

  !> Reference point of moments (m), F or else O, in the coordinates of the mechanisms: relative to O in the plane, to F in space.
  pure function moment_point(frame, about_frame) result(point)
    class(frame_type), intent(in) :: frame
    logical, intent(in) :: about_frame
    real(dp), allocatable :: point(:)

    if (allocated(frame%space)) then
      point = merge(0.0_dp, frame%space%origin, about_frame)
    else
      point = merge(-frame%origin, 0.0_dp, about_frame)
    end if
  end function moment_point

  !> Computes harmonics, maxima and rotating vectors of the shaking forces of a frame in space. Moments are about O, the origin of
  !> the mechanisms.
  subroutine shaking_in_space(frame, computed)
    class(frame_type), intent(in) :: frame
    type(space_shaking_type), intent(out) :: computed
    integer, parameter :: most = 8192
    !> Estimated rounding error of a sample, relative to the sum of the absolute values of its terms.
    real(dp), parameter :: rounding = 1.0e-12_dp
    real(dp), allocatable :: h(:, :)
    real(dp) :: terms(2)
    integer :: i, n

    terms = frame%space%terms()
    computed%noise = rounding * frame%speed**2 * [spread(terms(1), 1, 3), spread(terms(2), 1, 3)]
    n = max(128, min(most, 4 * frame%least_steps))
    do
      if (allocated(h)) deallocate(h)
      allocate(h(n, 6))
      call frame%space%shake(frame%speed, frame%crank_angles([(real(i, dp) / n, i = 0, n - 1)]), h)
      do i = 1, n
        h(i, 4:) = h(i, 4:) - cross(frame%space%origin, (h(i, :3)))
      end do
      call find_series(transpose(h), computed%series)
      if (n >= most .or. all([(computed%series(i)%tail() < 1.0e-9_dp .or. computed%series(i)%largest_term() <= computed%noise(i), &
        & i = 1, 6)])) exit
      n = 2 * n
    end do
    computed%rms = [(computed%series(i)%rms(), i = 1, 6)]
    if (.not. all(ieee_is_finite(computed%rms))) return
    computed%peak = [(computed%series(i)%peak(h(:, i)), i = 1, 6)]
    ! A Fourier series overshoots where the acceleration jumps.
    if (frame%mechanism%jumps) computed%peak = maxval(abs(h), dim=1)
    computed%shaft = frame%shaft_axes(:, 3)
    associate (x => frame%shaft_axes(:, 1), y => frame%shaft_axes(:, 2))
      computed%force = turning_vectors(computed%series(:3), size(computed%series(1)%amplitude), x, sign(1.0_dp, frame%speed) * y)
      computed%couple = turning_vectors(computed%series(4:), size(computed%series(1)%amplitude), x, sign(1.0_dp, frame%speed) * y)
    end associate
  end subroutine shaking_in_space

  !> Splits a vector's component in the plane of `x` and `y` into two rotating vectors for each order 1, 2, .... Returns their
  !> magnitudes, shape (orders, 2). If the components along x and y are Re C_x e^(ik theta) and Re C_y e^(ik theta), the component x
  !> + iy is
  !>
  !>     F+ e^(ik theta) + F- e^(-ik theta),   |F+-| = |C_x +- i C_y| / 2.
  pure function turning_vectors(series, orders, x, y) result(sizes)
    !> Fourier series of the components along xi, eta, zeta
    type(fourier_type), intent(in) :: series(3)
    integer, intent(in) :: orders
    !> Unit vectors that span the plane. The crank turns from `x` to `y`
    real(dp), intent(in) :: x(3), y(3)
    real(dp) :: sizes(orders, 2)
    complex(dp), parameter :: i = (0.0_dp, 1.0_dp)
    complex(dp), dimension(orders) :: c, along_x, along_y
    integer :: k

    along_x = 0
    along_y = 0
    do k = 1, 3
      c = series(k)%amplitude(:orders) * exp(i * series(k)%phase(:orders))
      along_x = along_x + x(k) * c
      along_y = along_y + y(k) * c
    end do
    sizes(:, 1) = abs(along_x + i * along_y) / 2
    sizes(:, 2) = abs(along_x - i * along_y) / 2
  end function turning_vectors

end module gestell_model_frame_shaking

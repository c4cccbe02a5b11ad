!> Computes the distances of the natural frequencies of a machine from the orders of its crank, as branches with derivatives.
!>
!> If two natural frequencies are equal, even a tiny change of the machine can rotate the eigenvectors by any angle, so the larger
!> frequency has no derivative. Its square is the maximum of Rayleigh's quotient u' C u / u' M u over all directions u in the plane
!> of the two modes (R. A. Horn, C. R. Johnson, Matrix Analysis, 1985, section 4.2). Therefore directions at all angles in this
!> plane are branches too. With mean gyroscopic moments G, which grow with the speed, the root w of w^2 u* M u = i w u* G u + u* C u
!> replaces the quotient. This root is stationary at the modes, too.
module gestell_study_design_separation
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: eigensystem, inverse_factor, symmetric_pencil
  use gestell_math_matrix, only: unit_matrix
  use gestell_model_frame, only: frame_type
  use gestell_system_averaged, only: averaged_system
  implicit none (type, external)
  private

  public :: find_branches, compute_distances

  !> Branches of the separation, which is the distance of natural frequencies from orders. Each branch combines a direction in which
  !> the machine vibrates with a harmonic of the period.
  type, public :: separation_type
    !> Directions of vibration, shape (degrees of freedom, branches)
    complex(dp), allocatable :: u(:, :)
    !> `harmonic`: number of the harmonic. `side`: 1 if the frequency should stay above the harmonic, -1 if it should stay below.
    !> Both have shape (branches)
    integer, allocatable :: harmonic(:), side(:)
  end type separation_type

  !> `orders`: largest order of the drive that is considered. `around`: number of directions in the plane of two modes that are used
  !> as branches.
  integer, parameter :: orders = 4, around = 12
  !> Two modes get further branches if the relative difference of the squares of their frequencies is smaller than this: for
  !> another machine of the search the two frequencies may coincide.
  real(dp), parameter :: near = 0.1_dp

contains

  !> Finds the branches of a machine. There is one branch for each mode and each harmonic that the shafts excite, up to four times
  !> the drive's speed. There are further branches for directions between modes whose frequencies may coincide. If the frequency
  !> of a mode coincides with an order at some speed of the range, its branch requires that the frequency leaves the range at the
  !> nearer end. Fails if the mass matrix is not positive definite.
  subroutine find_branches(frame, speeds, branches, error)
    !> The machine whose modes are computed
    class(frame_type), intent(in) :: frame
    !> Minimum and maximum speed (rad/s) of the shaft that makes one turn in the period; 0: the machine's own speed
    real(dp), intent(in) :: speeds(2)
    !> The branches: directions of the modes and directions between modes
    type(separation_type), intent(out) :: branches
    type(error_type), allocatable, intent(out) :: error
    type(averaged_system) :: model
    complex(dp), allocatable :: modes(:, :, :)
    real(dp), allocatable :: frequencies(:, :)
    integer, allocatable :: harmonics(:), side(:, :)
    real(dp) :: ends(2)
    integer :: d, e, h, i, k, n

    call frame%averaged(model)
    n = size(model%m, 1)
    harmonics = frame%mechanism%harmonics(orders)
    ends = ends_of(frame, speeds)
    allocate(modes(n, n, 2), frequencies(n, 2), side(n, size(harmonics)))
    do e = 1, 2
      call find_modes(model%m, gyroscopic(frame, model, ends(e)), (model%c + transpose(model%c)) / 2, frequencies(:, e), &
        & modes(:, :, e), error)
      if (allocated(error)) return
    end do
    allocate(branches%u(n, 0), branches%harmonic(0), branches%side(0))
    do h = 1, size(harmonics)
      do i = 1, n
        side(i, h) = merge(1, -1, frequencies(i, 2) / (harmonics(h) * ends(2)) - 1 &
          & > 1 - frequencies(i, 1) / (harmonics(h) * ends(1)))
        call add(modes(:, i, end_of(side(i, h))), harmonics(h), side(i, h))
      end do
    end do
    do i = 1, n
      do k = 1, i - 1
        do h = 1, size(harmonics)
          e = end_of(side(i, h))
          associate (squares => frequencies([i, k], e) * abs(frequencies([i, k], e)))
            if (side(i, h) /= side(k, h) .or. abs(squares(1) - squares(2)) > near * maxval(abs(squares))) cycle
          end associate
          do d = 1, around - 1
            call add(cos(pi * d / around) * modes(:, i, e) + sin(pi * d / around) * modes(:, k, e), harmonics(h), side(i, h))
          end do
        end do
      end do
    end do

  contains

    subroutine add(u, harmonic, which)
      complex(dp), intent(in) :: u(:)
      integer, intent(in) :: harmonic, which

      branches%u = reshape([branches%u, u], [size(u), size(branches%harmonic) + 1])
      branches%harmonic = [branches%harmonic, harmonic]
      branches%side = [branches%side, which]
    end subroutine add

  end subroutine find_branches

  !> Computes the distance of each branch from its order, in per cent, at that end of the range where frequency and order are
  !> closest. Let f be the frequency, k the harmonic and n the speed. The distance is 100 (f / (k n) - 1) for frequencies above the
  !> order, and 100 (1 - f / (k n)) for frequencies below it. The distance is negative if the frequency coincides with the order
  !> within the range.
  subroutine compute_distances(frame, speeds, branches, distances)
    !> The machine whose distances are computed
    class(frame_type), intent(in) :: frame
    !> Speeds at the ends of the range: see `find_branches`
    real(dp), intent(in) :: speeds(2)
    !> Branches, found for this machine or for a neighbour of it
    type(separation_type), intent(in) :: branches
    !> The distances (%), shape (branches)
    real(dp), allocatable, intent(out) :: distances(:)
    type(averaged_system) :: model
    real(dp) :: ends(2), m, g, c, root, frequency
    integer :: b

    call frame%averaged(model)
    ends = ends_of(frame, speeds)
    allocate(distances(size(branches%side)))
    do b = 1, size(distances)
      associate (u => branches%u(:, b), side => branches%side(b))
        m = real(dot_product(u, matmul(model%m, u)), dp)
        g = aimag(dot_product(u, matmul(gyroscopic(frame, model, ends(end_of(side))), u)))
        c = real(dot_product(u, matmul(model%c, u)), dp)
        root = g**2 + 4 * m * c
        frequency = -sqrt(max(0.0_dp, -c / m))
        if (root >= 0) frequency = (sqrt(root) - g) / (2 * m)
        distances(b) = 100 * side * (frequency / (branches%harmonic(b) * ends(end_of(side))) - 1)
      end associate
    end do
  end subroutine compute_distances

  !> Computes the undamped natural frequencies w, in ascending order, and the mode shapes u of the vibrations u exp(i w t). The
  !> gyroscopic moments `g` are included, except for modes that do not oscillate. Fails if the mass matrix is not positive
  !> definite.
  subroutine find_modes(m, g, c, frequencies, modes, error)
    real(dp), intent(in) :: m(:, :), g(:, :), c(:, :)
    real(dp), intent(out) :: frequencies(:)
    complex(dp), intent(out) :: modes(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: states(2 * size(m, 1), 2 * size(m, 1))
    complex(dp), allocatable :: values(:), right(:, :), left(:, :)
    real(dp), allocatable :: r(:, :), squares(:), vectors(:, :)
    integer :: i, k, n

    call symmetric_pencil(c, m, squares, error, vectors)
    if (allocated(error)) return
    frequencies = sign(sqrt(abs(squares)), squares)
    modes = vectors
    if (.not. any(abs(g) > 0)) return
    call inverse_factor(m, r, error)
    if (allocated(error)) return
    n = size(m, 1)
    states(:n, :n) = 0
    states(:n, n + 1:) = unit_matrix(n)
    states(n + 1:, :n) = -matmul(r, matmul(c, transpose(r)))
    states(n + 1:, n + 1:) = -matmul(r, matmul(g, transpose(r)))
    call eigensystem(states, values, right, left, error)
    if (allocated(error)) return
    do i = n, n - count(aimag(values) > 0) + 1, -1
      k = maxloc(aimag(values), dim=1)
      frequencies(i) = aimag(values(k))
      modes(:, i) = matmul(transpose(r), right(:n, k))
      values(k) = 0
    end do
  end subroutine find_modes

  !> Matrix of the gyroscopic moments, averaged over the turn, at a speed of the crank (rad/s).
  pure function gyroscopic(frame, model, speed) result(g)
    class(frame_type), intent(in) :: frame
    type(averaged_system), intent(in) :: model
    real(dp), intent(in) :: speed
    real(dp), allocatable :: g(:, :)

    g = (model%b - transpose(model%b)) / 2 * (speed / abs(frame%speed))
  end function gyroscopic

  !> Index of the end of the speed range at which a frequency is closest to an order: 2, the highest speed, for a frequency above
  !> the order; 1, the lowest speed, for a frequency below it.
  pure integer function end_of(side)
    integer, intent(in) :: side

    end_of = merge(2, 1, side > 0)
  end function end_of

  !> Minimum and maximum speed of the range (rad/s).
  pure function ends_of(frame, speeds) result(ends)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: speeds(2)
    real(dp) :: ends(2)

    ends = speeds
    if (.not. speeds(2) > 0) ends = abs(frame%speed)
  end function ends_of

end module gestell_study_design_separation

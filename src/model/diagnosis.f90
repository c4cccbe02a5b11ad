!> What a linkage tells before any dynamics: mobility, Grashof's class, ranges, transmission angles, shaking forces.
module gestell_model_diagnosis
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_fourier, only: fourier_series, fourier_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_joints_driven, only: crank_joint, ground_joint
  use gestell_model_joints_joint, only: fitness_type, point_type
  use gestell_model_joints_lever, only: rigid_joint
  use gestell_model_joints_rrr, only: rrr_joint
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism, only: mass_functions_type, mechanism_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: diagnose, diagnose_transmission, shaking

  !> What one joint does over a turn.
  type, public :: joint_report_type
    !> Least and greatest x, y and, for a slider, travel on its guide (m).
    real(dp) :: x(2) = 0, y(2) = 0, travel(2) = 0
    logical :: slides = .false.
    !> Smallest transmission angle (rad, at most pi/2) and the crank angle where it is met (rad).
    real(dp) :: transmission = pi / 2, transmission_at = 0
    !> Least change of one of its lengths that would reach a dead point (m), huge where none can.
    real(dp) :: margin = huge(1.0_dp)
  end type joint_report_type

  type, public :: diagnosis_type
    !> Gruebler's count: links with the frame, pairs of one degree of freedom, mobility 3 (links - 1) - 2 pairs.
    integer :: links = 0, pairs = 0, mobility = 0
    !> Grashof's class of a four-bar, else empty.
    character(len=40) :: grashof = ""
    type(joint_report_type), allocatable :: joints(:)
    !> Whether each link turns fully, else the angle that it swings through (rad).
    logical, allocatable :: turns(:)
    real(dp), allocatable :: swing(:)
  end type diagnosis_type

contains

  !> The diagnosis of a linkage. Error: it has no joints or no links.
  subroutine diagnose(linkage, diagnosis, error)
    class(linkage_type), intent(in) :: linkage
    type(diagnosis_type), intent(out) :: diagnosis
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    call linkage%check(error)
    if (allocated(error)) return
    call count_links(linkage, diagnosis)
    diagnosis%grashof = grashof_class(linkage)
    call diagnose_transmission(linkage, diagnosis)
    do i = 1, size(linkage%joints)
      call follow_joint(linkage, i, diagnosis%joints(i))
    end do
    call follow_links(linkage, diagnosis)
  end subroutine diagnose

  !> Of the diagnosis the transmission angles and margins alone.
  subroutine diagnose_transmission(linkage, diagnosis)
    class(linkage_type), intent(in) :: linkage
    type(diagnosis_type), intent(inout) :: diagnosis
    real(dp) :: sine
    integer :: i

    allocate(diagnosis%joints(size(linkage%joints)))
    do i = 1, size(linkage%joints)
      associate (report => diagnosis%joints(i))
        sine = extreme(linkage, i, 4, -1, report%transmission_at)
        report%transmission = asin(min(1.0_dp, sine))
        report%margin = extreme(linkage, i, 5, -1)
      end associate
    end do
  end subroutine diagnose_transmission

  !> Every dyad brings two links and three pairs, the crank one of each.
  subroutine count_links(linkage, diagnosis)
    class(linkage_type), intent(in) :: linkage
    type(diagnosis_type), intent(inout) :: diagnosis
    integer :: i

    diagnosis%links = 1
    do i = 1, size(linkage%joints)
      select type (joint => linkage%joints(i)%joint)
      class is (ground_joint)
      class is (rigid_joint)
      class is (crank_joint)
        diagnosis%links = diagnosis%links + 1
        diagnosis%pairs = diagnosis%pairs + 1
      class default
        diagnosis%links = diagnosis%links + 2
        diagnosis%pairs = diagnosis%pairs + 3
      end select
    end do
    diagnosis%mobility = 3 * (diagnosis%links - 1) - 2 * diagnosis%pairs
  end subroutine count_links

  !> A four-bar is one RRR dyad between the crank's joint and a ground joint. It turns, so by Grashof's rule the shortest
  !> and the longest link together are shorter than the other two; which one is shortest makes the class.
  character(len=40) function grashof_class(linkage)
    class(linkage_type), intent(in) :: linkage
    type(point_type) :: at(size(linkage%joints))
    real(dp) :: lengths(4)
    integer :: i, crank, dyad, other

    grashof_class = ""
    crank = 0
    dyad = 0
    do i = 1, size(linkage%joints)
      select type (joint => linkage%joints(i)%joint)
      class is (ground_joint)
      class is (rigid_joint)
      class is (crank_joint)
        crank = i
      class is (rrr_joint)
        if (dyad > 0) return
        dyad = i
      class default
        return
      end select
    end do
    if (dyad == 0) return
    select type (joint => linkage%joints(dyad)%joint)
    class is (rrr_joint)
      if (.not. any(joint%ends == crank)) return
      other = sum(joint%ends) - crank
      lengths(2) = joint%lengths(findloc(joint%ends, crank, dim=1))
      lengths(3) = joint%lengths(findloc(joint%ends, other, dim=1))
    end select
    select type (joint => linkage%joints(other)%joint)
    class is (ground_joint)
    class default
      return
    end select
    call linkage%points(0.0_dp, at)
    select type (joint => linkage%joints(crank)%joint)
    class is (crank_joint)
      lengths(1) = joint%radius
      lengths(4) = hypot(at(other)%x%v - at(joint%pivot)%x%v, at(other)%y%v - at(joint%pivot)%y%v)
    end select
    select case (minloc(lengths, dim=1))
    case (1)
      grashof_class = "crank-rocker (the crank is shortest)"
    case (4)
      grashof_class = "double crank (the ground is shortest)"
    case default
      grashof_class = ""
    end select
  end function grashof_class

  !> Where a joint goes over a turn.
  subroutine follow_joint(linkage, number, report)
    class(linkage_type), intent(in) :: linkage
    integer, intent(in) :: number
    type(joint_report_type), intent(inout) :: report
    type(fitness_type) :: fitness

    fitness = fitness_at(linkage, number, 0.0_dp)
    report%slides = fitness%slides
    report%x = [extreme(linkage, number, 1, -1), extreme(linkage, number, 1, 1)]
    report%y = [extreme(linkage, number, 2, -1), extreme(linkage, number, 2, 1)]
    if (report%slides) report%travel = [extreme(linkage, number, 3, -1), extreme(linkage, number, 3, 1)]
  end subroutine follow_joint

  pure function fitness_at(linkage, number, angle) result(fitness)
    class(linkage_type), intent(in) :: linkage
    integer, intent(in) :: number
    real(dp), intent(in) :: angle
    type(fitness_type) :: fitness
    type(point_type) :: at(size(linkage%joints))

    call linkage%points(angle, at)
    fitness = linkage%joints(number)%joint%fitness(at, at(number))
  end function fitness_at

  !> Quantity `which` of a joint at a crank angle: x, y, travel, transmission, margin.
  pure real(dp) function quantity(linkage, number, which, angle)
    class(linkage_type), intent(in) :: linkage
    integer, intent(in) :: number, which
    real(dp), intent(in) :: angle
    type(point_type) :: at(size(linkage%joints))
    type(fitness_type) :: fitness

    call linkage%points(angle, at)
    fitness = linkage%joints(number)%joint%fitness(at, at(number))
    select case (which)
    case (1)
      quantity = at(number)%x%v
    case (2)
      quantity = at(number)%y%v
    case (3)
      quantity = fitness%travel
    case (4)
      quantity = fitness%transmission
    case default
      quantity = fitness%margin
    end select
  end function quantity

  !> The least (`sense` = -1) or greatest (1) value of a quantity over the turn, and where it is met: the best of 720 angles,
  !> refined by golden sections.
  real(dp) function extreme(linkage, number, which, sense, place)
    class(linkage_type), intent(in) :: linkage
    integer, intent(in) :: number, which, sense
    real(dp), intent(out), optional :: place
    integer, parameter :: samples = 720
    real(dp), parameter :: golden = (sqrt(5.0_dp) - 1) / 2
    real(dp) :: values(samples), left, right, a, b
    integer :: i, iteration

    values = [(sense * quantity(linkage, number, which, 2 * pi * i / samples), i = 0, samples - 1)]
    i = maxloc(values, dim=1) - 1
    left = 2 * pi * (i - 1) / samples
    right = 2 * pi * (i + 1) / samples
    do iteration = 1, 40
      a = right - golden * (right - left)
      b = left + golden * (right - left)
      if (sense * quantity(linkage, number, which, a) > sense * quantity(linkage, number, which, b)) then
        right = b
      else
        left = a
      end if
    end do
    extreme = sense * max(values(i + 1), sense * quantity(linkage, number, which, (left + right) / 2))
    if (present(place)) place = modulo((left + right) / 2, 2 * pi)
  end function extreme

  !> The links' angles, followed step by step through the turn.
  subroutine follow_links(linkage, diagnosis)
    class(linkage_type), intent(in) :: linkage
    type(diagnosis_type), intent(inout) :: diagnosis
    integer, parameter :: samples = 1440
    type(point_type) :: at(size(linkage%joints))
    real(dp) :: u(2), before(2), angle, least, greatest
    integer :: i, k

    allocate(diagnosis%turns(size(linkage%links)), source=.false.)
    allocate(diagnosis%swing(size(linkage%links)), source=0.0_dp)
    do i = 1, size(linkage%links)
      associate (link => linkage%links(i))
        if (link%to == 0) cycle
        angle = 0
        least = 0
        greatest = 0
        do k = 0, samples
          call linkage%points(2 * pi * k / samples, at)
          u = [at(link%to)%x%v - at(link%from)%x%v, at(link%to)%y%v - at(link%from)%y%v]
          if (k > 0) angle = angle + atan2(before(1) * u(2) - before(2) * u(1), dot_product(before, u))
          before = u
          least = min(least, angle)
          greatest = max(greatest, angle)
        end do
        diagnosis%turns(i) = abs(angle) > pi
        diagnosis%swing(i) = greatest - least
      end associate
    end do
  end subroutine follow_links

  !> Harmonics of the shaking forces along x and y (N) and of the shaking moment about O (N m) at a speed (rad/s). Errors: the
  !> mechanism is not made yet; the speed is not finite.
  subroutine shaking(mechanism, speed, series, error)
    class(mechanism_type), intent(in) :: mechanism
    real(dp), intent(in) :: speed
    type(fourier_type), intent(out) :: series(3)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most = 8192
    real(dp), allocatable :: samples(:, :)
    type(mass_functions_type) :: a
    integer :: i, n

    call mechanism%check(error)
    if (allocated(error)) return
    if (.not. (ieee_is_finite(speed) .and. mechanism%feature > 0)) then
      call fatal_error(error, "the speed must be finite, and the mechanism's feature positive", invalid_input)
      return
    end if
    ! Fewer samples than the mechanism's feature asks for could take a high order for a low one.
    n = max(128, ceiling(min(real(most, dp), 8 * pi / mechanism%feature)))
    do
      if (allocated(samples)) deallocate(samples)
      allocate(samples(n, 3))
      do i = 1, n
        call mechanism%mass_functions(2 * pi * (i - 1) / n, a)
        samples(i, :) = -speed**2 * [a%a1%dd, a%a2%dd, a%a4]
      end do
      do i = 1, 3
        series(i) = fourier_series(samples(:, i))
      end do
      if (maxval([(series(i)%tail(), i = 1, 3)]) < 1.0e-9_dp .or. n >= most) exit
      n = 2 * n
    end do
  end subroutine shaking

end module gestell_model_diagnosis

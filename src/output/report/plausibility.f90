!> Warns of probable typing errors in the input: values that hardly any machine has. Usually a unit, a power of ten or a name is
!> wrong.
module gestell_output_report_plausibility
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, newline
  use gestell_model_frame, only: frame_type
  use gestell_model_joints_joint, only: form_type, point_type
  use gestell_model_joints_types_cylinder, only: cylinder_joint
  use gestell_model_joints_types_follower, only: follower_joint
  use gestell_model_joints_types_rpr, only: rpr_joint
  use gestell_model_linkage, only: linkage_type
  implicit none (type, external)
  private

  public :: implausible_values

  !> Maximum plausible speed of a joint (m/s). A steel ring whose rim has this speed carries the stress rho v^2 = 2 GPa, which
  !> exceeds its strength.
  real(dp), parameter :: fastest = 500
  !> Maximum plausible acceleration of a joint (m/s^2), about ten thousand times that of gravity
  real(dp), parameter :: max_acceleration = 1.0e5_dp
  !> Maximum and minimum plausible size of a mechanism (m)
  real(dp), parameter :: widest = 20, narrowest = 1.0e-3_dp
  !> Minimum and maximum plausible radius of gyration, divided by the size of the machine; usual ratios are 0.05 to 0.5. If a mass
  !> or a moment of inertia is wrong by a factor of 1000, the radius is wrong by a factor of 32.
  real(dp), parameter :: min_radius = 0.02_dp, max_radius = 3
  !> Minimum plausible radius of gyration of a link, divided by the length of the link; the ratio is 0.29 for a uniform rod
  real(dp), parameter :: smallest_of_link = 0.01_dp
  !> `no_mass`: a frame with less than this fraction of the total mass is not a real body. `light`: a frame with less than this
  !> fraction of the mechanism's mass is suspiciously light.
  real(dp), parameter :: no_mass = 1.0e-3_dp, light = 0.1_dp
  !> `gravity`: acceleration of gravity (m/s^2). `suspicious_deflection`: a warning is given if the static deflection, divided by
  !> the size of the machine, exceeds this value. A deflection of 0.25 m corresponds to a natural frequency of 1 Hz; mounted
  !> machines usually have 2 to 30 Hz.
  real(dp), parameter :: gravity = 9.81_dp, suspicious_deflection = 0.25_dp
  !> A warning is given if the damping ratio of the machine along every axis exceeds this value. Rubber mounts reach a damping
  !> ratio of 0.15, oil dampers reach 1
  real(dp), parameter :: overdamped = 5
  !> Relative change of a link's length during a turn that is too large to be rounding error
  real(dp), parameter :: largest_stretch = 1.0e-6_dp
  !> Maximum plausible share that the upper half of the orders of a lift table contributes to the follower's rms acceleration
  real(dp), parameter :: largest_share = 0.1_dp
  integer, parameter :: samples = 72
  character(len=*), parameter :: check_units = ": check the units (by default m, kg, N, s; see &units)", &
    & check_masses = ": check mass and inertia"

  !> Extreme values of a mechanism's motion over its period.
  type :: extremes_type
    !> Maximum speed (m/s) and maximum acceleration (m/s^2) over all joints
    real(dp) :: speed = 0, acceleration = 0
    !> `fastest_joint`: index of the joint with the maximum speed. `accelerated_joint`: index of the joint with the maximum
    !> acceleration
    integer :: fastest_joint = 0, accelerated_joint = 0
    !> Lower left and upper right corner of the smallest rectangle that contains all positions of the joints (m)
    real(dp) :: low(2) = 0, high(2) = 0
    !> For each link: minimum and maximum distance between its two joints over the period (m)
    real(dp), allocatable :: shortest(:), longest(:)
  end type extremes_type

contains

  !> Lines that each describe a probable typing error; empty if there is none. Only linkages are checked.
  function implausible_values(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines
    type(extremes_type) :: extremes
    real(dp) :: extent, size_of_machine, low(3), high(3)
    integer :: i

    lines = ""
    select type (mechanism => frame%mechanism)
    class is (linkage_type)
      call find_extremes(mechanism, abs(frame%speed), extremes)
      extent = maxval(extremes%high - extremes%low)
      if (extremes%speed > fastest) then
        lines = "joint '" // mechanism%joints(extremes%fastest_joint)%name // "' moves at " // up_to(extremes%speed) &
          & // " m/s, more than " // concise(fastest) // " m/s" // check_units // newline
      else if (extremes%acceleration > max_acceleration) then
        lines = "joint '" // mechanism%joints(extremes%accelerated_joint)%name // "' has an acceleration of " &
          & // up_to(extremes%acceleration) &
          & // " m/s^2, more than " // concise(max_acceleration) // " m/s^2" // check_units // newline
      end if
      if (extent > widest) lines = lines // "the mechanism is " // concise(extent, 3) // " m wide, more than " // concise(widest) &
        & // " m" // check_units // newline
      if (extent < narrowest) lines = lines // "the mechanism is " // concise(extent, 3) // " m wide, less than " &
        & // concise(narrowest) // " m" // check_units // newline
      ! diagonal of the box around the mechanism, the frame's centre of mass and the heads of the supports
      low = [min(extremes%low + frame%origin, 0.0_dp), 0.0_dp]
      high = [max(extremes%high + frame%origin, 0.0_dp), 0.0_dp]
      do i = 1, size(frame%supports)
        low = min(low, frame%supports(i)%position)
        high = max(high, frame%supports(i)%position)
      end do
      size_of_machine = norm2(high - low)
      lines = lines // frame_warning(frame, mechanism%mass, size_of_machine)
      lines = lines // mounting_warnings(frame, frame%mass + mechanism%mass, size_of_machine)
      do i = 1, size(mechanism%links)
        lines = lines // link_warnings(mechanism, i, extremes, size_of_machine)
      end do
      do i = 1, size(mechanism%joints)
        select type (joint => mechanism%joints(i)%joint)
        class is (follower_joint)
          if (allocated(joint%law)) then
            if (any(abs(joint%law%jumps()) > 0)) lines = lines // "joint '" // mechanism%joints(i)%name // "': the acceleration " &
              & // "of its law jumps, so peaks of accelerations are less accurate (--check lists the jumps)" // newline
          else
            lines = lines // lift_warning(mechanism%joints(i)%name, joint%lift, joint%table_orders)
          end if
        end select
      end do
    end select
  end function implausible_values

  !> Phrase for a maximum: "up to 23.4", or "more than ..." if its computation overflowed.
  pure function up_to(value) result(words)
    real(dp), intent(in) :: value
    character(len=:), allocatable :: words

    words = either("more than ", "up to ", value > huge(value)) // concise(min(value, huge(value)), 3)
  end function up_to

  !> Warning if the mass or the radius of gyration of the frame is implausible; otherwise empty.
  pure function frame_warning(frame, moving_mass, size_of_machine) result(line)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: moving_mass, size_of_machine
    character(len=:), allocatable :: line
    real(dp) :: radius

    line = ""
    if (frame%mass > no_mass * (frame%mass + moving_mass) .and. frame%mass < light * moving_mass) then
      line = "the frame has " // concise(frame%mass) // " kg, the mechanism " // concise(moving_mass) // " kg: check the frame's " &
        & // "mass" // newline
      return
    end if
    ! Without supports the size of the frame is unknown.
    if (size(frame%supports) == 0) return
    if (.not. (frame%inertia > 0 .and. frame%mass > no_mass * (frame%mass + moving_mass) .and. any(frame%free >= 3))) return
    radius = sqrt(maxval(frame%moments_of_inertia())) / sqrt(frame%mass)
    if (radius >= min_radius * size_of_machine .and. radius <= max_radius * size_of_machine) return
    line = "the frame's radius of gyration is " // concise(radius, 3) // " m, but the machine is " // concise(size_of_machine, 3) &
      & // " m wide" // check_masses // newline
  end function frame_warning

  !> Warnings if the mounting is too soft even along its stiffest axis, or overdamped even along its least damped axis; otherwise
  !> empty.
  pure function mounting_warnings(frame, mass, size_of_machine) result(lines)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: mass, size_of_machine
    character(len=:), allocatable :: lines
    !> Indices of the displacements xi, eta and zeta among the degrees of freedom
    integer, parameter :: shifts(3) = [1, 2, 4]
    real(dp), allocatable :: stiffness(:, :), damping(:, :), along(:), ratios(:)
    integer, allocatable :: axes(:)
    real(dp) :: k, sag
    integer :: i

    lines = ""
    axes = pack(shifts, [(any(frame%free == shifts(i)), i = 1, size(shifts))])
    stiffness = frame%ground_stiffness()
    damping = frame%damping
    along = [(stiffness(axes(i), axes(i)), i = 1, size(axes))]
    axes = pack(axes, along > 0)
    if (size(axes) == 0) return
    k = maxval(along)
    ratios = [(quotient(quotient(damping(axes(i), axes(i)), sqrt(stiffness(axes(i), axes(i)))), sqrt(mass)) / 2, i = 1, size(axes))]
    sag = quotient(mass, k / gravity)
    if (sag > suspicious_deflection * size_of_machine) lines = "under its weight the machine would sink by " &
      & // concise(sag, 3) // " m even along the stiffest axis of its mounts (" // concise(sqrt(k) / sqrt(mass) / (2 * pi), 3) &
      & // " Hz): check the stiffness (by default in N/m; see &units)" // newline
    if (minval(ratios) > overdamped) lines = lines // "along every axis the machine has at least " // concise(minval(ratios), 3) &
      & // " times its critical damping: check the damping (by default in N s/m; see &units)" // newline
  end function mounting_warnings

  !> Quotient a / b of positive numbers; the largest finite number if the quotient overflows.
  elemental real(dp) function quotient(a, b)
    real(dp), intent(in) :: a, b

    quotient = huge(a)
    if (b >= 1 .or. a < min(b, 1.0_dp) * huge(a)) quotient = a / b
  end function quotient

  !> Warnings if the radius of gyration, the centre of mass or the length of link `i` is implausible; otherwise empty.
  function link_warnings(mechanism, i, extremes, size_of_machine) result(lines)
    class(linkage_type), intent(in) :: mechanism
    integer, intent(in) :: i
    type(extremes_type), intent(in) :: extremes
    real(dp), intent(in) :: size_of_machine
    character(len=:), allocatable :: lines
    real(dp) :: radius

    lines = ""
    associate (link => mechanism%links(i), subject => "link '" // mechanism%links(i)%name // "'")
      if (.not. (link%mass > 0)) return
      radius = sqrt(link%inertia) / sqrt(link%mass)
      if (radius > max_radius * size_of_machine) then
        lines = subject // ": its radius of gyration is " // concise(radius, 3) // " m, but the machine is " &
          & // concise(size_of_machine, 3) // " m wide" // check_masses // newline
      else if (radius > 0 .and. radius < smallest_of_link * extremes%shortest(i)) then
        lines = subject // ": its radius of gyration is " // concise(radius, 3) // " m, its length " &
          & // concise(extremes%longest(i), 3) // " m" // check_masses // newline
      end if
      if (norm2(link%center) > max_radius * size_of_machine) lines = lines // subject // ": its centre of mass is " &
        & // concise(norm2(link%center), 3) // " m from joint '" // mechanism%joints(link%from)%name // "', the machine is " &
        & // concise(size_of_machine, 3) // " m wide: check center" // newline
      if (link%to == 0) return
      if (extremes%longest(i) - extremes%shortest(i) <= largest_stretch * extremes%longest(i)) return
      if (.not. slides(mechanism, link%from, link%to)) lines = lines // subject // " connects '" &
        & // mechanism%joints(link%from)%name // "' and '" // mechanism%joints(link%to)%name &
        & // "', but their distance varies from " // concise(extremes%shortest(i), 3) // " to " &
        & // concise(extremes%longest(i), 3) // " m" // newline
    end associate
  end function link_warnings

  !> True if the distance between the joints `one` and `other` may change, because one of these joints slides along a moving body or
  !> in the slot of a yoke, or because a cylinder connects them.
  logical function slides(mechanism, one, other)
    class(linkage_type), intent(in) :: mechanism
    integer, intent(in) :: one, other
    type(form_type) :: form
    integer :: i, k

    slides = .false.
    do i = 1, size(mechanism%joints)
      select type (joint => mechanism%joints(i)%joint)
      class is (rpr_joint)
        slides = slides .or. all(joint%ends == [one, other]) .or. all(joint%ends == [other, one])
      class is (cylinder_joint)
        slides = slides .or. all([joint%ends(2), i] == [one, other]) .or. all([i, joint%ends(2)] == [one, other])
      end select
      if (i /= one .and. i /= other) cycle
      call mechanism%joints(i)%joint%describe(form)
      slides = slides .or. any(form%name == ["PRP", "RPP"])
      if (.not. allocated(form%guides)) cycle
      do k = 1, size(form%guides)
        slides = slides .or. any(form%guides(k)%carriers > 0)
      end do
    end do
  end function slides

  !> Warning if the upper half of the orders contributes too much to a follower's acceleration; otherwise empty. In the
  !> acceleration the lift of order k has the weight k^2. `orders`: highest order of the lift table, or 0 if there is no such
  !> table.
  pure function lift_warning(name, lift, orders) result(line)
    character(len=*), intent(in) :: name
    real(dp), intent(in) :: lift(:)
    integer, intent(in) :: orders
    character(len=:), allocatable :: line
    integer, parameter :: fewest = 8
    real(dp) :: squares(size(lift) / 2), part
    integer :: k

    line = ""
    if (orders < fewest) return
    squares = [(real(k, dp)**4 * sum(lift(2 * k:2 * k + 1)**2), k = 1, size(squares))]
    if (.not. sum(squares) > 0) return
    part = sqrt(sum(squares(orders / 2 + 1:)) / sum(squares))
    if (part > largest_share) line = "joint '" // name // "': " // concise(100 * part, 2) // " % of its acceleration (rms) " // &
      &   "comes from the upper half of the orders that lift_table can represent, " // concise(real(orders / 2 + 1, dp)) // " to " &
      & // concise(real(orders, dp)) // ": check whether the values of lift_table have enough digits, or limit the orders " // &
      &   "with harmonics=" // concise(real(orders / 2, dp)) // newline
  end function lift_warning

  !> Finds the extreme values of a linkage at `samples` positions of the crank, which rotates with the angular velocity `omega`
  !> (rad/s).
  subroutine find_extremes(linkage, omega, extremes)
    class(linkage_type), intent(in) :: linkage
    real(dp), intent(in) :: omega
    type(extremes_type), intent(out) :: extremes
    type(point_type) :: at(size(linkage%joints))
    real(dp), dimension(size(linkage%joints)) :: first, second
    real(dp) :: length
    integer :: i, k

    first = 0
    second = 0
    extremes%low = huge(1.0_dp)
    extremes%high = -huge(1.0_dp)
    allocate(extremes%shortest(size(linkage%links)), source=huge(1.0_dp))
    allocate(extremes%longest(size(linkage%links)), source=0.0_dp)
    do k = 0, samples - 1
      call linkage%points(2 * pi * k / samples, at)
      first = max(first, hypot(at%x%d, at%y%d))
      second = max(second, hypot(at%x%dd, at%y%dd))
      extremes%low = min(extremes%low, [minval(at%x%v), minval(at%y%v)])
      extremes%high = max(extremes%high, [maxval(at%x%v), maxval(at%y%v)])
      do i = 1, size(linkage%links)
        length = 0
        associate (link => linkage%links(i))
          if (link%to > 0) length = hypot(at(link%to)%x%v - at(link%from)%x%v, at(link%to)%y%v - at(link%from)%y%v)
        end associate
        extremes%shortest(i) = min(extremes%shortest(i), length)
        extremes%longest(i) = max(extremes%longest(i), length)
      end do
    end do
    extremes%fastest_joint = maxloc(first, dim=1)
    extremes%accelerated_joint = maxloc(second, dim=1)
    extremes%speed = first(extremes%fastest_joint) * omega
    extremes%acceleration = second(extremes%accelerated_joint) * omega**2
  end subroutine find_extremes

end module gestell_output_report_plausibility

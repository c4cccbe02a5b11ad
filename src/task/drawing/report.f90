!> Reports properties of the mechanism that do not depend on the vibration: mobility, motions, transmission angle, shaking forces.
module gestell_task_drawing_report
  use gestell_base_error, only: error_type
  use gestell_base_key, only: all_words
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, fixed, newline, text
  use gestell_input_wording, only: counted
  use gestell_model_joints_law, only: law_names
  use gestell_model_joints_types_follower, only: follower_joint
  use gestell_model_linkage_diagnosis, only: diagnose, diagnose_joints, diagnosis_type
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_shaking, only: shaking_in_space, space_shaking_type
  use gestell_model_mechanism_shaking, only: shaking, shaking_type
  use gestell_output_report_table_lines, only: in_degrees, table_lines
  use gestell_output_report_text_table, only: listed, number_cells, tab, tabulated
  use gestell_output_report_wrapping, only: wrapped
  use gestell_output_table, only: table_type
  use gestell_model_linkage, only: linkage_type
  use gestell_study_balance, only: examine, rigid_ground_type
  use gestell_study_balance_bodies, only: counterweight_type
  use gestell_study_balance_complete, only: balance_force, balanced, balanced_already
  use gestell_task_forces_reactions, only: static_force, support_positions
  use gestell_task_drawing_balance_table, only: tabulate_plane, tabulate_space
  use gestell_task_drawing_strokes, only: stroke_table
  use gestell_task_separation_torque_roll, only: axis_line
  implicit none (type, external)
  private

  public :: report_mechanism, report_transmission

  !> Transmission angles (deg) below this value are reported as poor
  real(dp), parameter :: poor_angle = 40

contains

  !> The section of the report on the mechanism, with its shaking forces and the static loads.
  function report_mechanism(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines, rows, motion
    type(diagnosis_type) :: diagnosis
    type(error_type), allocatable :: failure
    real(dp) :: size_of_all
    integer :: i

    lines = ""
    select type (mechanism => frame%mechanism)
    class is (linkage_type)
      call diagnose(mechanism, diagnosis, failure)
      lines = newline // "MECHANISM" // newline // "  mobility " // text(diagnosis%mobility) // " (" &
        & // text(diagnosis%links) // " links including the frame, " // counted(diagnosis%pairs, "pair")
      if (diagnosis%higher_pairs > 0) lines = lines // ", " // counted(diagnosis%higher_pairs, "higher pair")
      lines = lines // ")"
      if (len_trim(diagnosis%grashof) > 0) lines = lines // "; " // trim(diagnosis%grashof)
      lines = lines // newline
      size_of_all = maxval([(maxval(abs([diagnosis%joints(i)%x, diagnosis%joints(i)%y])), i = 1, size(diagnosis%joints))])
      rows = ""
      do i = 1, size(mechanism%joints)
        associate (joint => diagnosis%joints(i))
          rows = rows // trim(mechanism%joints(i)%name) // tab // extent(joint%x, size_of_all) // tab &
            & // extent(joint%y, size_of_all) // tab
          if (joint%slides) rows = rows // concise(joint%travel(2) - joint%travel(1))
          rows = rows // newline
        end associate
      end do
      lines = lines // tabulated("lllr", "joint,x,y,stroke" // newline // ",m,m,m", rows)
      rows = ""
      do i = 1, size(mechanism%links)
        if (mechanism%links(i)%to == 0) then
          motion = "translates"
        else if (diagnosis%turns(i)) then
          motion = "turns fully"
        else
          motion = "swings through " // fixed(diagnosis%swing(i) * 180 / pi, 2) // " deg"
        end if
        rows = rows // trim(mechanism%links(i)%name) // tab // motion // newline
      end do
      lines = lines // tabulated("ll", "link,motion", rows) // transmission_line(mechanism, diagnosis) &
        & // slider_lines(mechanism, diagnosis, frame) // law_lines(mechanism)
    end select
    if (frame%dofs() > 3) then
      lines = lines // shaking_lines_in_space(frame) // axis_line(frame)
    else
      lines = lines // shaking_lines(frame)
    end if
    if (frame%weights%act) lines = lines // static_lines(frame)
  end function report_mechanism

  !> Table of the forces that the supports exert on the ground when the machine is at rest, due to gravity.
  function static_lines(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines, rows
    real(dp), allocatable :: places(:, :), force(:)
    integer :: i

    rows = ""
    places = support_positions(frame)
    do i = 1, size(places, 2)
      force = static_force(frame, text(i))
      force = merge(0.0_dp, force, abs(force) <= 1.0e-12_dp * norm2(frame%weights%weight))
      rows = rows // text(i) // " at (" // listed(places(:, i), 4, ", ") // ")" // number_cells(force, 5) // newline
    end do
    force = static_force(frame, "total")
    rows = rows // "total" // number_cells(force, 5) // newline
    lines = newline // "STATIC LOADS on the ground, with the moving masses averaged over the turn" // newline &
      & // tabulated("l" // repeat("r", size(force)), "support,fx,fy" // either(",fz", "", size(force) == 3) // newline &
      & // repeat(",N", size(force)), rows)
  end function static_lines

  !> Line on the transmission angle of a linkage, for the report of a run; empty for other mechanisms.
  function report_transmission(frame) result(line)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: line
    type(diagnosis_type) :: diagnosis

    line = ""
    select type (mechanism => frame%mechanism)
    class is (linkage_type)
      call diagnose_joints(mechanism, diagnosis)
      line = transmission_line(mechanism, diagnosis)
    end select
  end function report_transmission

  !> Lines on the smallest transmission angle and on the nearest dead point. For the dead point they name the joint at which a link
  !> length must change to reach the dead point, and state the change.
  function transmission_line(mechanism, diagnosis) result(line)
    class(linkage_type), intent(in) :: mechanism
    type(diagnosis_type), intent(in) :: diagnosis
    character(len=:), allocatable :: line
    integer :: worst, nearest
    real(dp) :: angle

    worst = minloc(diagnosis%joints%transmission, dim=1)
    nearest = minloc(diagnosis%joints%margin, dim=1)
    angle = diagnosis%joints(worst)%transmission * 180 / pi
    line = ""
    if (angle > 89.999_dp) return
    line = "  smallest transmission angle " // concise(angle, 3) // " deg at joint '" // mechanism%joints(worst)%name &
      & // "', crank angle " // fixed(diagnosis%joints(worst)%transmission_at * mechanism%turns * 180 / pi, 1) // " deg"
    if (angle < poor_angle) line = line // "  <- poor"
    line = line // newline
    if (diagnosis%joints(nearest)%margin < huge(1.0_dp)) line = line // "  nearest dead point: reached if a link length at " &
      & // "joint '" &
      & // mechanism%joints(nearest)%name // "' changes by " // concise(diagnosis%joints(nearest)%margin, 3) // " m" // newline
  end function transmission_line

  !> Section on the motion of the sliders; empty if there are none.
  function slider_lines(mechanism, diagnosis, frame) result(lines)
    class(linkage_type), intent(in) :: mechanism
    type(diagnosis_type), intent(in) :: diagnosis
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines

    lines = ""
    if (any(diagnosis%joints%slides)) lines = newline // "SLIDERS at " // concise(abs(frame%drive_rpm())) // " rpm, maximum " &
      & // "speed and acceleration along their guides" // newline // table_lines(stroke_table(frame, mechanism, diagnosis), &
      & "lrrrrr", "slider,stroke,speed,acceleration,forward,time" // newline // ",m,m/s,m/s^2,deg,forward/back", [1, 5, 5, 5, 5, 5])
  end function slider_lines

  !> Table of the segments of all cam laws; empty if there are none.
  function law_lines(mechanism) result(lines)
    class(linkage_type), intent(in) :: mechanism
    character(len=:), allocatable :: lines, rows
    character(len=20), allocatable :: names(:)
    real(dp), allocatable :: jumps(:)
    integer :: i, k

    rows = ""
    names = all_words(law_names)
    do i = 1, size(mechanism%joints)
      select type (joint => mechanism%joints(i)%joint)
      class is (follower_joint)
        if (.not. allocated(joint%law)) cycle
        jumps = joint%law%jumps()
        do k = 1, size(jumps)
          rows = rows // mechanism%joints(i)%name // tab // trim(names(joint%law%laws(k))) // number_cells([joint%law%ends(k) &
            & * 180 / pi, joint%law%lifts(k), jumps(k)], 5) // newline
        end do
      end select
    end do
    lines = ""
    if (rows /= "") lines = newline // "CAM LAWS: lift and velocity are continuous; at the end of each segment: angle of the " // &
      &   "cam, lift, jump of the acceleration per (rad/s)^2 of the cam's speed" // newline // tabulated("llrrr", &
      & "slider,law,angle,lift,jump" // newline // ",,deg,m,m", rows)
  end function law_lines

  !> Section on the shaking forces and the shaking moment of a planar frame, for each order of the crank.
  function shaking_lines(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines
    type(shaking_type) :: forces
    type(table_type) :: balance, unbalance
    type(error_type), allocatable :: failure
    character(len=*), parameter :: ratios(3) = [character(len=8) :: "fx", ", fy", ", moment"]
    integer :: i

    call shaking(frame%mechanism, frame%speed, forces, failure, frame%uniform_in_space())
    lines = newline // "SHAKING FORCES of the mechanism on a frame at rest"
    if (.not. forces%is_finite()) then
      lines = lines // ": they overflow double precision" // newline
      return
    end if
    call tabulate_plane(frame, forces, balance, unbalance)
    lines = lines // ", amplitudes and phases" // newline &
      & // table_lines(balance, "rrrrrrr", "order,fx,,fy,,moment about O" // newline // ",N,deg,N,deg,N m,deg", spread(5, 1, 7)) &
      & // "  resultant force: peak " // concise(forces%peak(4), 5) // " N, rms " // concise(forces%rms(4), 5) // " N" // newline &
      & // "  mean ratio of successive amplitudes: "
    do i = 1, 3
      lines = lines // trim(ratios(i)) // " " // concise(amplitude_ratio(forces%series(i)%amplitude), 2)
    end do
    lines = lines // newline // "  unbalance of order 1  rotating with the crank     " // vector(1) // newline &
      & // "                        rotating against the crank  " // vector(2) // newline // balance_lines(frame)

  contains

    !> An unbalance as text: its magnitude in kg mm, and its direction when the crank angle is zero.
    pure function vector(row) result(words)
      integer, intent(in) :: row
      character(len=:), allocatable :: words

      associate (magnitude => unbalance%columns(2)%numbers(row), angle => unbalance%columns(3)%numbers(row))
        words = "0"
        if (magnitude > 0) words = concise(1000 * magnitude, 5) // " kg mm at " // in_degrees(angle) // " deg"
      end associate
    end function vector

  end function shaking_lines

  !> Section on the shaking forces and couples of a frame in space, for each order of the crank.
  function shaking_lines_in_space(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines, rotating, shaft
    type(space_shaking_type) :: forces
    type(table_type) :: balance
    integer :: i

    lines = newline // "SHAKING FORCES AND COUPLES of all mechanisms on a frame at rest"
    call shaking_in_space(frame, forces)
    if (.not. forces%is_finite()) then
      lines = lines // ":" // newline // "  they overflow double precision" // newline
      return
    end if
    call tabulate_space(frame, forces, balance)
    lines = lines // ", amplitudes" // newline // table_lines(balance, "rrrrrrr", "order,fx,fy,fz,mx,my,mz" // newline &
      & // ",N,N,N,N m,N m,N m", [1, (5, 0, i = 1, 6), 0, 0, 0, 0]) // "  couples are about the origin O; orders are multiples " &
      & // "of the crank speed" // newline
    ! the axis of the shaft is mentioned only if it is not the zeta axis
    shaft = ""
    if (forces%shaft(3) < 1) shaft = " (" // listed(forces%shaft, 3, ", ") // ")"
    rotating = table_lines(balance, "rrrrr", "order,force with,against,couple with,against" // newline // ",N,N,N m,N m", &
      & [1, (0, i = 1, 12), 5, 5, 5, 5], omit_zeros=.true.)
    if (rotating /= "") lines = lines // wrapped("  components normal to the first shaft" // shaft // ", rotating with and " &
      & // "against the crank:" // newline) // rotating
  end function shaking_lines_in_space

  !> Lines on the counterweights that balance the shaking force completely: unbalance and direction of each, in the axes of its
  !> link.
  function balance_lines(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines
    character(len=*), parameter :: head = "  complete balance      "
    type(rigid_ground_type) :: rigid
    type(counterweight_type), allocatable :: weights(:)
    type(error_type), allocatable :: failure
    integer :: state, k

    lines = ""
    select type (mechanism => frame%mechanism)
    class is (linkage_type)
      call examine(mechanism, frame%uniform_in_space(), [0.0_dp, 0.0_dp], rigid, failure)
      if (allocated(failure)) return
      call balance_force(rigid, weights, state)
      if (state == balanced_already) then
        lines = head // "not needed: the force is already balanced" // newline
      else if (state == balanced) then
        do k = 1, size(weights)
          associate (weight => weights(k))
            lines = lines // merge(head, repeat(" ", len(head)), k == 1) // "link '" &
              & // mechanism%links(rigid%bodies(weight%body)%link)%name // "' " // concise(1000 * weight%unbalance, 5) &
              & // " kg mm at " // in_degrees(weight%angle) // " deg" // newline
          end associate
        end do
        lines = lines // repeat(" ", len(head)) // "by counterweights; angles are measured from the link's first axis" // newline
      else
        lines = head // "impossible with counterweights on these links" // newline
      end if
    end select
  end function balance_lines

  !> Geometric mean of the ratios of successive amplitudes, from the largest amplitude to the last one above rounding error.
  pure real(dp) function amplitude_ratio(amplitude)
    real(dp), intent(in) :: amplitude(:)
    integer :: first, last

    amplitude_ratio = 0
    first = maxloc(amplitude, dim=1)
    if (.not. amplitude(first) > 0) return
    last = findloc(amplitude > 1.0e-11_dp * amplitude(first), .true., dim=1, back=.true.)
    if (last > first) amplitude_ratio = (amplitude(last) / amplitude(first))**(1.0_dp / (last - first))
  end function amplitude_ratio

  !> The lowest and the highest value as text. Values below 1e-9 of the mechanism's size count as zero.
  function extent(values, size_of_all) result(words)
    real(dp), intent(in) :: values(2), size_of_all
    character(len=:), allocatable :: words
    real(dp) :: rounded(2)

    rounded = merge(0.0_dp, values, abs(values) < 1.0e-9_dp * size_of_all)
    words = concise(rounded(1), 5)
    if (rounded(2) - rounded(1) > 1.0e-9_dp * size_of_all) words = words // " to " // concise(rounded(2), 5)
  end function extent

end module gestell_task_drawing_report

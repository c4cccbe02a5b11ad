!> What the mechanism tells before any dynamics, for people.
module gestell_task_drawing_report
  use gestell_base_error, only: error_type
  use gestell_math_fourier, only: fourier_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, fixed, text
  use gestell_input_wording, only: counted
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_model_linkage_diagnosis, only: diagnose, diagnose_joints, diagnosis_type, shaking
  use gestell_model_frame, only: frame_type
  use gestell_model_linkage, only: linkage_type
  use gestell_task_forces_ground, only: static_force
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: report_mechanism, report_transmission

  character, parameter :: newline = new_line("a")
  !> Below this transmission angle (deg) designers look for another mechanism.
  real(dp), parameter :: poor = 40

contains

  !> The whole diagnosis.
  function report_mechanism(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines
    type(diagnosis_type) :: diagnosis
    type(error_type), allocatable :: unprepared

    lines = ""
    select type (mechanism => frame%mechanism)
    class is (linkage_type)
      call diagnose(mechanism, diagnosis, unprepared)
      lines = newline // "MECHANISM" // newline // "  mobility " // text(diagnosis%mobility) // " (" &
        & // text(diagnosis%links) // " links with the frame, " // counted(diagnosis%pairs, "pair") // ")"
      if (len_trim(diagnosis%grashof) > 0) lines = lines // "; " // trim(diagnosis%grashof)
      lines = lines // newline // joint_lines(mechanism, diagnosis) // link_lines(mechanism, diagnosis) &
        & // transmission_line(mechanism, diagnosis)
    end select
    lines = lines // shaking_lines(frame)
    if (frame%weights%act) lines = lines // static_lines(frame)
  end function report_mechanism

  !> What the supports carry at static rest.
  function static_lines(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines, rows
    real(dp) :: force(2)
    integer :: i

    rows = ""
    do i = 1, size(frame%supports)
      associate (p => frame%supports(i)%position)
        rows = rows // text(i) // " at (" // concise(p(1), 4) // ", " // concise(p(2), 4) // ")"
      end associate
      force = static_force(frame, text(i))
      force = merge(0.0_dp, force, abs(force) <= 1.0e-12_dp * norm2(frame%weights%load(:2)))
      rows = rows // tab // concise(force(1), 5) // tab // concise(force(2), 5) // newline
    end do
    lines = newline // "STATIC LOADS on the ground, masses at their mean over the turn" // newline // tabulated("lrr", &
      & "support,fx,fy" // newline // ",N,N", rows // "weight of all" // tab // concise(frame%weights%load(1), 5) // tab &
      & // concise(frame%weights%load(2), 5) // newline)
  end function static_lines

  !> The one line that the report of a run has.
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

  function joint_lines(mechanism, diagnosis) result(lines)
    class(linkage_type), intent(in) :: mechanism
    type(diagnosis_type), intent(in) :: diagnosis
    character(len=:), allocatable :: lines
    real(dp) :: size_of_all
    integer :: i

    size_of_all = maxval([(maxval(abs([diagnosis%joints(i)%x, diagnosis%joints(i)%y])), i = 1, size(diagnosis%joints))])
    lines = ""
    do i = 1, size(mechanism%joints)
      associate (joint => diagnosis%joints(i))
        lines = lines // trim(mechanism%joints(i)%name) // tab // extent(joint%x, size_of_all) // tab &
          & // extent(joint%y, size_of_all) // tab
        if (joint%slides) lines = lines // concise(joint%travel(2) - joint%travel(1))
        lines = lines // newline
      end associate
    end do
    lines = tabulated("lllr", "joint,x,y,stroke" // newline // ",m,m,m", lines)
  end function joint_lines

  function link_lines(mechanism, diagnosis) result(lines)
    class(linkage_type), intent(in) :: mechanism
    type(diagnosis_type), intent(in) :: diagnosis
    character(len=:), allocatable :: lines, motion
    integer :: i

    lines = ""
    do i = 1, size(mechanism%links)
      if (mechanism%links(i)%to == 0) then
        motion = "translates"
      else if (diagnosis%turns(i)) then
        motion = "turns fully"
      else
        motion = "swings through " // fixed(diagnosis%swing(i) * 180 / pi, 2) // " deg"
      end if
      lines = lines // trim(mechanism%links(i)%name) // tab // motion // newline
    end do
    lines = tabulated("ll", "link,motion", lines)
  end function link_lines

  !> The smallest transmission angle, and the length that is nearest to a dead point.
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
    line = "  smallest transmission angle " // concise(angle, 3) // " deg, joint '" // mechanism%joints(worst)%name // "' at " &
      & // fixed(diagnosis%joints(worst)%transmission_at * 180 / pi, 1) // " deg"
    if (angle < poor) line = line // "  <- poor"
    line = line // newline
    if (diagnosis%joints(nearest)%margin < huge(1.0_dp)) line = line // "  nearest dead point: a length of joint '" &
      & // mechanism%joints(nearest)%name // "' changed by " // concise(diagnosis%joints(nearest)%margin, 3) // " m" // newline
  end function transmission_line

  function shaking_lines(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines, rows
    type(fourier_type) :: series(3)
    type(error_type), allocatable :: unprepared
    real(dp) :: amplitude, noise(3)
    integer :: k, i

    call shaking(frame%mechanism, frame%speed, series, unprepared, frame%even_in_space())
    lines = newline // "SHAKING FORCES of the mechanism on a frame at rest"
    if (.not. all([(ieee_is_finite(series(i)%rms()), i = 1, 3)])) then
      lines = lines // ": they lie beyond what double precision holds" // newline
      return
    end if
    ! Beside the force along one axis, rounding is all that a small one along the other is.
    noise(:2) = 1.0e-11_dp * max(maxval(series(1)%amplitude), maxval(series(2)%amplitude))
    noise(3) = 1.0e-11_dp * maxval(series(3)%amplitude)
    rows = ""
    do k = 1, 8
      rows = rows // text(k)
      do i = 1, 3
        amplitude = series(i)%amplitude(k)
        if (amplitude < noise(i)) amplitude = 0
        rows = rows // tab // concise(amplitude, 5)
      end do
      rows = rows // newline
    end do
    lines = lines // ", amplitudes" // newline // tabulated("rrrr", "order,fx,fy,moment about O" // newline // ",N,N,N m", rows)
    lines = lines // "  from order to order they fall by factors of about "
    do i = 1, 3
      if (i > 1) lines = lines // ", "
      lines = lines // concise(decay(series(i)%amplitude), 2)
    end do
    lines = lines // newline
  end function shaking_lines

  !> The mean factor from one order to the next, from the greatest amplitude to the last above rounding.
  pure real(dp) function decay(amplitude)
    real(dp), intent(in) :: amplitude(:)
    integer :: first, last

    decay = 0
    first = maxloc(amplitude, dim=1)
    if (.not. amplitude(first) > 0) return
    last = findloc(amplitude > 1.0e-11_dp * amplitude(first), .true., dim=1, back=.true.)
    if (last > first) decay = (amplitude(last) / amplitude(first))**(1.0_dp / (last - first))
  end function decay

  !> A range as words, rounded to 1e-9 of the mechanism's size.
  function extent(values, size_of_all) result(words)
    real(dp), intent(in) :: values(2), size_of_all
    character(len=:), allocatable :: words
    real(dp) :: rounded(2)

    rounded = merge(0.0_dp, values, abs(values) < 1.0e-9_dp * size_of_all)
    words = concise(rounded(1), 5)
    if (rounded(2) - rounded(1) > 1.0e-9_dp * size_of_all) words = words // " to " // concise(rounded(2), 5)
  end function extent

end module gestell_task_drawing_report

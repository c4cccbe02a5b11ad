!> Writes the report of the task `forces`.
module gestell_task_forces_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, fixed, newline, text
  use gestell_model_frame, only: frame_type
  use gestell_output_report_significance, only: zero_if_noise, order_words
  use gestell_output_report_text_table, only: listed, number_cells, tab, tabulated
  use gestell_task_forces_reactions, only: along_x, along_y, along_z, moment, moment_x, moment_y, reaction_type, force_magnitude
  implicit none (type, external)
  private

  public :: force_lines

contains

  !> Table of all reactions and their total, followed by a line on the support with the largest force.
  pure function force_lines(reactions, frame) result(lines)
    type(reaction_type), intent(in) :: reactions(:)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines
    !> Largest distance from F at which a reaction acts (m). It is set to 1 if all reactions act at F
    real(dp) :: arm
    real(dp) :: peaks(size(reactions))
    integer :: i, most

    lines = ""
    do i = 1, size(reactions)
      lines = lines // reaction_line(reactions(i), frame%mechanism%turns) // newline
    end do
    peaks = [(reactions(i)%statistics(force_magnitude)%peak, i = 1, size(reactions))]
    arm = maxval([(norm2(reactions(i)%position), i = 1, size(reactions))])
    if (.not. arm > 0) arm = 1
    associate (axes => size(reactions(1)%position))
      lines = tabulated("l" // repeat("r", axes + 3) // "l", ",fx peak,fy peak" // either(",fz peak", "", axes == 3) &
        & // ",f peak,error,f rms,strongest" // newline // repeat(",N", axes + 3) // ",order", lines)
    end associate
    ! number of the support with the largest force; 0 if no support exerts a force
    most = maxloc(peaks, dim=1, mask=.not. reactions%turns .and. peaks > 0)
    if (most > 0) lines = lines // "  support " // trim(reactions(most)%name) // " has the largest peak: " &
      & // concise(peaks(most), 5) // " N" // newline
    associate (total => reactions(size(reactions)), total_peak => peaks(size(peaks)))
      if (any(.not. reactions%turns .and. peaks > total_peak)) lines = lines // &
        & "  the forces of the supports partly cancel: the peak of their sum is lower than the peak of one support" // newline
      if (total_peak > 0) lines = lines // "  peak of the total force: " // concise(total_peak, 5) // " N" &
        & // crank_angle(total, force_magnitude) // newline
      if (size(total%position) == 3) lines = lines // moment_line(moment_x, "xi through ") &
        & // moment_line(moment_y, "eta through ") // moment_line(moment, "zeta through ")
      if (size(total%position) == 2) lines = lines // moment_line(moment, "")
    end associate
    if (any(reactions%includes_weight)) lines = lines // static_lines(reactions)

  contains

    !> Line on the peak of the total moment about an axis through F; empty if the moment is only rounding error.
    pure function moment_line(part, axis) result(line)
      integer, intent(in) :: part
      character(len=*), intent(in) :: axis
      character(len=:), allocatable :: line

      line = ""
      associate (total => reactions(size(reactions)), m => reactions(size(reactions))%statistics(part))
        if (m%peak * zero_if_noise(m%peak, m%peak_error, arm * total%statistics(force_magnitude)%peak) > 0) line = &
          & "  peak of the total moment about " // axis // "F: " // concise(m%peak, 5) // " N m" // crank_angle(total, part) &
          & // ", rms " // concise(m%rms, 5) // " N m" // newline
      end associate
    end function moment_line

    !> Crank angle at which a component of a reaction has its peak, as text.
    pure function crank_angle(reaction, part) result(words)
      type(reaction_type), intent(in) :: reaction
      integer, intent(in) :: part
      character(len=:), allocatable :: words

      words = " at crank angle " // fixed(frame%degrees_per_period() * reaction%statistics(part)%peak_phase, 1) // " deg"
    end function crank_angle

  end function force_lines

  !> Table of the static force and the minimum compression of every reaction. Guides have no minimum compression, because they can
  !> push and pull.
  pure function static_lines(reactions) result(lines)
    type(reaction_type), intent(in) :: reactions(:)
    character(len=:), allocatable :: lines
    real(dp), parameter :: rounding = 1.0e-12_dp
    real(dp) :: weight
    integer :: i

    lines = ""
    weight = norm2(reactions(size(reactions))%static)
    do i = 1, size(reactions)
      associate (reaction => reactions(i))
        lines = lines // reaction_label(reaction) &
          & // number_cells(merge(0.0_dp, reaction%static, abs(reaction%static) <= rounding * weight), 5) // tab
        if (reaction%name /= "guide") lines = lines // concise(reaction%least_compression, 5) // tab &
          & // concise(reaction%min_error, 1) // tab
        ! lifting off matters only for a support that carries load and is not bolted
        if (reaction%bears_load .and. reaction%least_compression < reaction%min_error) lines = lines &
          & // either("LIFTS OFF", "may lift off", reaction%least_compression < -reaction%min_error)
        lines = lines // newline
      end associate
    end do
    associate (axes => size(reactions(1)%static))
      lines = tabulated("l" // repeat("r", axes + 2) // "l", ",fx,fy" // either(",fz", "", axes == 3) // ",minimum,error,unless" &
        & // newline // repeat(",static N", axes) // ",compr. N,N,bolted", lines)
    end associate
  end function static_lines

  !> Row of the table for one reaction: peaks, error bound, rms, and the order with the largest amplitude.
  pure function reaction_line(reaction, turns) result(line)
    type(reaction_type), intent(in) :: reaction
    integer, intent(in) :: turns
    character(len=:), allocatable :: line
    integer :: order

    line = reaction_label(reaction) // component(along_x) // component(along_y)
    if (size(reaction%position) == 3) line = line // component(along_z)
    associate (f => reaction%statistics(force_magnitude))
      order = f%strongest()
      line = line // tab // concise(f%peak, 5) // tab // concise(f%peak_error, 1) // tab // concise(f%rms, 5) // tab
      if (order > 0) line = line // order_words(order, f%amplitude(order), f%rms, turns)
    end associate

  contains

    !> Peak of a component as a table cell; 0 if it is a rounding error relative to the whole force.
    pure function component(part) result(words)
      integer, intent(in) :: part
      character(len=:), allocatable :: words

      associate (f => reaction%statistics(part), whole => reaction%statistics(force_magnitude))
        words = tab // concise(zero_if_noise(f%peak, f%peak_error, whole%peak) * f%peak, 5)
      end associate
    end function component

  end function reaction_line

  !> Name of a reaction. For a support in the plane, its position is added.
  pure function reaction_label(reaction) result(line)
    type(reaction_type), intent(in) :: reaction
    character(len=:), allocatable :: line

    line = trim(reaction%name)
    if (.not. reaction%turns) line = "support " // line
    if (reaction%turns .or. size(reaction%position) == 3) return
    line = line // " (" // listed(reaction%position, 4, ",") // ")"
  end function reaction_label

end module gestell_task_forces_report

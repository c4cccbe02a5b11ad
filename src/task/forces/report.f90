!> Forces on the ground, for people.
module gestell_task_forces_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, fixed, text
  use gestell_output_report_significance, only: noise_of, order_words
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_output_report_verdict, only: section
  use gestell_task_forces_reactions, only: along_x, along_y, moment, reaction_type, whole_force
  implicit none (type, external)
  private

  public :: force_lines

  character, parameter :: newline = new_line("a")

contains

  !> Every reaction and the total, and which support carries most.
  pure function force_lines(reactions, speed, verdict) result(lines)
    type(reaction_type), intent(in) :: reactions(:)
    real(dp), intent(in) :: speed
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: lines
    integer :: i, most

    lines = ""
    do i = 1, size(reactions)
      lines = lines // reaction_line(reactions(i)) // newline
    end do
    lines = section("FORCES ON THE GROUND, " // trim(merge("by the motion ", "without weight", any(reactions%weighed))) &
      & // "; f: size of the vector; %: of rms^2", verdict) // tabulated("lrrrrrl", &
      & ",fx peak,fy peak,f peak,error,f rms,strongest" // newline // ",N,N,N,N,N,order", lines)
    most = most_loaded(reactions)
    if (most > 0) then
      if (reactions(most)%statistics(whole_force)%peak > 0) lines = lines // "  support " // trim(reactions(most)%name) &
        & // " carries most: up to " // concise(reactions(most)%statistics(whole_force)%peak, 5) // " N" // newline
    end if
    associate (total => reactions(size(reactions)))
      if (most > 0) then
        if (total%statistics(whole_force)%peak < reactions(most)%statistics(whole_force)%peak) lines = lines // &
          & "  the supports push against each other: all together exert less than one alone" // newline
      end if
      if (total%statistics(whole_force)%peak > 0) lines = lines // "  all together up to " &
        & // concise(total%statistics(whole_force)%peak, 5) // " N" // crank_angle(total, whole_force) // newline
      if (total%statistics(moment)%peak * noise_of(total%statistics(moment)%peak, total%statistics(moment)%peak_error, &
        & arm(reactions) * total%statistics(whole_force)%peak) > 0) lines = lines // "  their moment about F up to " &
        & // concise(total%statistics(moment)%peak, 5) // " N m" // crank_angle(total, moment) // ", rms " &
        & // concise(total%statistics(moment)%rms, 5) // " N m" // newline
    end associate
    if (any(reactions%weighed)) lines = lines // static_lines(reactions)

  contains

    !> Where the peak is.
    pure function crank_angle(reaction, part) result(words)
      type(reaction_type), intent(in) :: reaction
      integer, intent(in) :: part
      character(len=:), allocatable :: words

      words = " at crank angle " // fixed(sign(360.0_dp, speed) * reaction%statistics(part)%peak_phase, 1) // " deg"
    end function crank_angle

  end function force_lines

  !> Static load and least compression of every reaction; those of guides act on both sides.
  pure function static_lines(reactions) result(lines)
    type(reaction_type), intent(in) :: reactions(:)
    character(len=:), allocatable :: lines
    integer :: i

    lines = ""
    do i = 1, size(reactions)
      associate (reaction => reactions(i), static => cleared(reactions(i)%static, reactions(size(reactions))%static))
        lines = lines // labelled(reaction) // tab // concise(static(1), 5) // tab // concise(static(2), 5) // tab
        if (reaction%name /= "guide") lines = lines // concise(reaction%least_compression, 5) // tab &
          & // concise(reaction%least_error, 1) // tab
        if (reaction%carrying) lines = lines // lift_off(reaction)
        lines = lines // newline
      end associate
    end do
    lines = tabulated("lrrrrl", ",fx,fy,least,error,unless" // newline // ",static N,static N,compr. N,N,bolted", lines)
  end function static_lines

  !> Whether the frame leaves a support that only stands there.
  pure function lift_off(reaction) result(words)
    type(reaction_type), intent(in) :: reaction
    character(len=:), allocatable :: words

    words = ""
    if (reaction%least_compression < reaction%least_error) words = "may lift off"
    if (reaction%least_compression < -reaction%least_error) words = "LIFTS OFF"
  end function lift_off

  !> Static forces without what is rounding beside the weight.
  pure function cleared(force, weight) result(clear)
    real(dp), intent(in) :: force(2), weight(2)
    real(dp), parameter :: rounding = 1.0e-12_dp
    real(dp) :: clear(2)

    clear = merge(0.0_dp, force, abs(force) <= rounding * norm2(weight))
  end function cleared

  !> The greatest distance of a reaction from F (m); 1 where all are there.
  pure real(dp) function arm(reactions)
    type(reaction_type), intent(in) :: reactions(:)
    integer :: i

    arm = maxval([(norm2(reactions(i)%position), i = 1, size(reactions))])
    if (.not. arm > 0) arm = 1
  end function arm

  pure function reaction_line(reaction) result(line)
    type(reaction_type), intent(in) :: reaction
    character(len=:), allocatable :: line
    real(dp) :: zero(2)
    integer :: order

    line = labelled(reaction)
    associate (fx => reaction%statistics(along_x), fy => reaction%statistics(along_y), f => reaction%statistics(whole_force))
      order = f%strongest()
      zero = [noise_of(fx%peak, fx%peak_error, f%peak), noise_of(fy%peak, fy%peak_error, f%peak)]
      line = line // tab // concise(zero(1) * fx%peak, 5) // tab // concise(zero(2) * fy%peak, 5) // tab // concise(f%peak, 5) &
        & // tab // concise(f%peak_error, 1) // tab // concise(f%rms, 5) // tab
      if (order > 0) line = line // order_words(order, f%amplitude(order), f%rms)
    end associate
  end function reaction_line

  !> What a reaction is called.
  pure function labelled(reaction) result(line)
    type(reaction_type), intent(in) :: reaction
    character(len=:), allocatable :: line

    line = trim(reaction%name)
    if (.not. reaction%turns) line = "support " // line // " (" // concise(reaction%position(1), 4) // "," &
      & // concise(reaction%position(2), 4) // ")"
  end function labelled

  !> The support whose force is greatest; 0: there is none.
  pure integer function most_loaded(reactions) result(most)
    type(reaction_type), intent(in) :: reactions(:)
    integer :: i

    most = 0
    do i = 1, size(reactions)
      if (reactions(i)%turns) cycle
      if (most == 0) most = i
      if (reactions(i)%statistics(whole_force)%peak > reactions(most)%statistics(whole_force)%peak) most = i
    end do
  end function most_loaded

end module gestell_task_forces_report

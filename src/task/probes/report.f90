!> The vibration at probes, for people.
module gestell_task_probes_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_input_wording, only: padded
  use gestell_output_report_verdict, only: judged, section
  use gestell_task_probes_watched, only: probe_parts, velocity_part, watched_type
  implicit none (type, external)
  private

  public :: limits_told, probe_lines

  character, parameter :: newline = new_line("a")

contains

  !> Every probe, with its verdict where it has a limit. `period`: of the crank (s).
  pure function probe_lines(watched, period, verdict) result(lines)
    type(watched_type), intent(in) :: watched(:)
    real(dp), intent(in) :: period
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: lines
    integer :: i

    lines = section("VIBRATION AT PROBES, peaks of the size of the vector, and rms in the direction where it is greatest", &
      & verdict) // "                               displacement mm  velocity mm/s  acceleration m/s^2   rms in band mm/s" &
      & // newline
    do i = 1, size(watched)
      lines = lines // probe_line(watched(i)) // newline // band_line(watched(i), period, verdict) // newline
    end do
  end function probe_lines

  pure function probe_line(watched) result(line)
    type(watched_type), intent(in) :: watched
    character(len=:), allocatable :: line
    real(dp), parameter :: factors(3) = [1.0e3_dp, 1.0e3_dp, 1.0_dp]
    integer, parameter :: widths(3) = [17, 15, 20]
    integer :: k

    line = "  " // trim(watched%probe%name) // " at (" // concise(watched%probe%position(1), 4) // ", " &
      & // concise(watched%probe%position(2), 4) // ")"
    line = line // repeat(" ", max(0, 29 - len(line)))
    do k = 1, 3
      line = line // padded(concise(factors(k) * watched%statistics(k * probe_parts / 3)%peak, 5), widths(k))
    end do
    line = line // padded(concise(1000 * watched%greatest, 5), 13) // " +- " // concise(1000 * watched%error, 1)
  end function probe_line

  !> Which orders the band holds, and the verdict.
  pure function band_line(watched, period, verdict) result(line)
    type(watched_type), intent(in) :: watched
    real(dp), intent(in) :: period
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: line
    !> The band leaves out what makes the whole so many times as great.
    real(dp), parameter :: much = 1.5_dp
    real(dp) :: orders(2), whole

    associate (band => watched%probe%band, limit => watched%probe%limit)
      line = "    band " // concise(band(1)) // " to " // concise(band(2)) // " Hz: "
      orders = min(band * period, 1.0e9_dp)
      orders = [max(1, ceiling(orders(1) * (1 - 1.0e-12_dp))), floor(orders(2) * (1 + 1.0e-12_dp))]
      if (orders(2) < orders(1)) then
        line = line // "no order of the crank lies in it"
      else
        line = line // "orders " // text(nint(orders(1))) // " to " // text(nint(orders(2))) // " of the crank"
      end if
      if (limit > 0) line = line // "; " // against_limit(watched)
      if (limit > 0 .and. judged(verdict) /= "") line = line // newline // "    " // judged(verdict)
      whole = watched%statistics(velocity_part)%rms
      if (whole > much * watched%greatest .and. orders(1) > 1) line = line // newline // "    mind the lower end of the band: " // &
        & "the velocity in all orders together has an rms of " // concise(1000 * whole, 4) // " mm/s"
    end associate
  end function band_line

  !> The verdict in words.
  pure function against_limit(watched) result(words)
    type(watched_type), intent(in) :: watched
    character(len=:), allocatable :: words

    associate (limit => watched%probe%limit)
      select case (watched%verdict())
      case ("within")
        words = "WITHIN the limit of " // concise(1000 * limit) // " mm/s, at " // concise(100 * watched%greatest / limit, 3) &
          & // " % of it"
      case ("above")
        words = "ABOVE the limit of " // concise(1000 * limit) // " mm/s, by " &
          & // concise(100 * (watched%greatest / limit - 1), 3) // " %"
      case default
        words = "UNDECIDED against the limit of " // concise(1000 * limit) // " mm/s: the error reaches across it"
      end select
    end associate
  end function against_limit

  !> One sentence for every probe that has a limit. `verdict`: of the machine.
  pure function limits_told(watched, verdict) result(sentences)
    type(watched_type), intent(in) :: watched(:)
    character(len=*), intent(in) :: verdict
    character(len=300), allocatable :: sentences(:)
    integer :: i, n

    allocate(sentences(count(watched%probe%limit > 0)))
    n = 0
    do i = 1, size(watched)
      if (.not. watched(i)%probe%limit > 0) cycle
      n = n + 1
      sentences(n) = trim(watched(i)%probe%name) // ": " // concise(1000 * watched(i)%greatest, 4) // " mm/s, " &
        & // against_limit(watched(i))
      if (judged(verdict) /= "") sentences(n) = judged(verdict) // "; " // sentences(n)
    end do
  end function limits_told

end module gestell_task_probes_report

!> Compares what the library claims about a machine's exact frame with the oracle.
module exact_check
  use exact_claims, only: claim_of, claim_type, claims_type, orders
  use oracle_frame, only: frame_type
  use oracle_machine, only: dp, xp
  use oracle_signals, only: signal_type
  use oracle_vibration, only: orbit_type
  use population_check, only: partners
  use reference_linear, only: qp
  implicit none (type, external)
  private

  public :: compare, verdict_is_wrong

  !> A comparison of one number with its bound: which part of the bound the error uses.
  type, public :: finding_type
    character(len=40) :: what = ""
    real(dp) :: claimed = 0, true = 0, bound = 0, used = 0
  end type finding_type

  !> Numbers that were compared with their bounds. The oracle is too inaccurate for a number if its own error exceeds a quarter
  !> of the bound: then an exceeded bound may remain undetected.
  type, public :: count_type
    integer :: numbers = 0, blunt = 0
  end type count_type

  !> Rounding error of the oracle, relative to the size of the quantity.
  real(xp), parameter :: oracle_rounding = 1.0e-16_xp

contains

  !> Number of all compared numbers.
  subroutine compare(claims, frame, orbit, signals, findings, counts)
    type(claims_type), intent(in) :: claims
    type(frame_type), intent(in) :: frame
    type(orbit_type), intent(in) :: orbit
    type(signal_type), intent(in) :: signals(:)
    type(finding_type), allocatable, intent(out) :: findings(:)
    type(count_type), intent(inout) :: counts
    type(claim_type) :: claim
    real(xp) :: relative
    integer :: k

    allocate(findings(0))
    relative = oracle_rounding + orbit%last_step
    call compare_multipliers(claims, orbit, findings, counts)
    if (.not. allocated(claims%quantities)) return
    do k = 1, size(signals)
      claim = claim_of(claims, trim(signals(k)%name))
      if (.not. allocated(claim%history)) then
        findings = [findings, finding_type(trim(signals(k)%name) // " not reported", used=huge(1.0_dp))]
        cycle
      end if
      call compare_signal(claim, signals(k), relative, findings, counts)
      if (signals(k)%name /= "probe(p).v") cycle
      call add(findings, counts, "probe(p).v band", claims%band, 1000 * signals(k)%band(frame%period, &
        & real(frame%machine%band, xp)), claims%band_error, 1000 * (signals(k)%unknown + relative * signals(k)%rms()))
    end do
    call compare_places(claims, frame, signals, relative, findings, counts)
  end subroutine compare

  !> Checks every multiplier against its bound, in the pairing that keeps most of them within.
  subroutine compare_multipliers(claims, orbit, findings, counts)
    type(claims_type), intent(in) :: claims
    type(orbit_type), intent(in) :: orbit
    type(finding_type), allocatable, intent(inout) :: findings(:)
    type(count_type), intent(inout) :: counts
    real(dp) :: cost(size(claims%rho), size(claims%rho)), bound, noise
    integer :: pair(size(claims%rho)), j, k, n

    n = size(claims%rho)
    noise = real(orbit%noise, dp)
    do k = 1, n
      do j = 1, n
        bound = claims%rho_error(k) * abs(claims%rho(k)) + noise
        cost(k, j) = real(abs(claims%rho(k) - orbit%rho(j)), dp) / max(bound, tiny(bound))
      end do
    end do
    cost = min(cost, 1.0e30_dp)
    pair = partners(cost)
    do k = 1, n
      counts%numbers = counts%numbers + 1
      if (.not. noise <= claims%rho_error(k) * abs(claims%rho(k)) / 4) counts%blunt = counts%blunt + 1
      findings = [findings, finding_type("multiplier, abs(difference)", abs(claims%rho(k)), real(abs(orbit%rho(pair(k))), dp), &
        & claims%rho_error(k) * abs(claims%rho(k)), cost(k, pair(k)))]
    end do
  end subroutine compare_multipliers

  !> `relative`: rounding error of the oracle, relative to the size of the quantity.
  subroutine compare_signal(claim, signal, relative, findings, counts)
    type(claim_type), intent(in) :: claim
    real(xp), intent(in) :: relative
    type(signal_type), intent(in) :: signal
    type(finding_type), allocatable, intent(inout) :: findings(:)
    type(count_type), intent(inout) :: counts
    real(xp) :: peak, own, at
    integer :: k, n

    peak = signal%peak()
    own = signal%unknown + relative * peak
    n = size(claim%history) - 1
    do k = 0, n - 1
      at = signal%at(1 + k * size(signal%samples, 1) / n)
      call add(findings, counts, trim(signal%name) // " history", claim%history(k + 1), at, claim%error, own)
    end do
    call add(findings, counts, trim(signal%name) // " peak", claim%peak, peak, claim%peak_error, own)
    if (signal%name /= "torque") call add(findings, counts, trim(signal%name) // " rms", claim%rms, signal%rms(), claim%error, own)
    do k = 1, size(claim%amplitudes)
      ! An error e at every time has harmonics of at most sqrt(2) e, by Parseval's theorem.
      call add(findings, counts, trim(signal%name) // " harmonic", claim%amplitudes(k), signal%amplitude(k), &
        & sqrt(2.0_dp) * claim%error, own)
    end do
  end subroutine compare_signal

  !> Checks static forces to 1e-12 of the weight, because they have no bound of their own, and least compressions.
  subroutine compare_places(claims, frame, signals, relative, findings, counts)
    type(claims_type), intent(in) :: claims
    type(frame_type), intent(in) :: frame
    type(signal_type), intent(in) :: signals(:)
    real(xp), intent(in) :: relative
    type(finding_type), allocatable, intent(inout) :: findings(:)
    type(count_type), intent(inout) :: counts
    complex(xp) :: static, down
    type(signal_type) :: along
    integer :: j, k, m, status

    if (.not. abs(frame%gravity) > 0) return
    down = frame%gravity / abs(frame%gravity)
    do k = 1, size(claims%places)
      read (claims%places(k)%name, *, iostat=status) j
      if (status /= 0) cycle
      static = sum(frame%springs(2 * j - 1:2 * j)%axis * frame%springs(2 * j - 1:2 * j)%static)
      call add(findings, counts, "static_fx", claims%places(k)%static(1), real(static), &
        & real(1.0e-12_xp * frame%mass * abs(frame%gravity), dp), 0.0_xp)
      call add(findings, counts, "static_fy", claims%places(k)%static(2), aimag(static), &
        & real(1.0e-12_xp * frame%mass * abs(frame%gravity), dp), 0.0_xp)
      do m = 1, size(signals)
        if (signals(m)%name /= "support(" // trim(claims%places(k)%name) // ").f") cycle
        allocate(along%samples(size(signals(m)%samples, 1), 1), along%c(0:ubound(signals(m)%c, 1), 1))
        along%samples(:, 1) = real(down) * signals(m)%samples(:, 1) + aimag(down) * signals(m)%samples(:, 2)
        along%c(:, 1) = real(down) * signals(m)%c(:, 1) + aimag(down) * signals(m)%c(:, 2)
        call add(findings, counts, "support(" // trim(claims%places(k)%name) // ") least", claims%places(k)%least, &
          & along%least() + real(static * conjg(down)), claims%places(k)%min_error, signals(m)%unknown + relative &
          & * (along%peak() + abs(static)))
        deallocate(along%samples, along%c)
      end do
    end do
  end subroutine compare_places

  !> Adds the comparison of a claimed number with its bound; `own`: the oracle's own error.
  subroutine add(findings, counts, what, claimed, true, bound, own)
    type(finding_type), allocatable, intent(inout) :: findings(:)
    type(count_type), intent(inout) :: counts
    character(len=*), intent(in) :: what
    real(dp), intent(in) :: claimed, bound
    real(xp), intent(in) :: true, own
    real(dp), parameter :: noted = 0.3_dp
    real(dp) :: used

    counts%numbers = counts%numbers + 1
    if (.not. own <= bound / 4) counts%blunt = counts%blunt + 1
    used = real(max(abs(claimed - true) - own, 0.0_xp) / max(real(bound, xp), tiny(1.0_xp)), dp)
    ! Neither program may return NaN or infinity.
    if (.not. (abs(claimed) <= huge(claimed) .and. abs(true) <= huge(true) .and. own <= huge(own))) used = huge(used)
    if (used > noted) findings = [findings, finding_type(what, claimed, real(true, dp), bound, used)]
  end subroutine add

  !> True if the verdict contradicts the largest modulus, or is undecided although the bound does not reach 1. The library's
  !> modulus is at most the bound away from the true one.
  pure logical function verdict_is_wrong(claims, orbit) result(wrong)
    type(claims_type), intent(in) :: claims
    type(orbit_type), intent(in) :: orbit
    !> Rounding error of the oracle, and of close pairs of multipliers on the unit circle.
    real(qp), parameter :: rounding = 1.0e-16_qp, of_pairs = 1.0e-12_qp
    real(qp) :: excess

    excess = maxval(abs(orbit%rho)) - 1
    select case (claims%verdict)
    case ("stable")
      wrong = excess > rounding
    case ("unstable")
      wrong = excess < -rounding
    case ("undamped")
      wrong = abs(excess) > of_pairs
    case default
      wrong = abs(excess) > 2 * claims%rho_error(1)
    end select
  end function verdict_is_wrong

end module exact_check

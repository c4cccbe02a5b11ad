!> What the library claims of a machine's exact frame beside the oracle.
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

  !> A number beside its bound: how much of the bound the error takes.
  type, public :: finding_type
    character(len=40) :: what = ""
    real(dp) :: claimed = 0, true = 0, bound = 0, used = 0
  end type finding_type

  !> What the oracle itself may miss, relative to the size of what it tells.
  real(xp), parameter :: oracle_rounding = 1.0e-16_xp

contains

  !> All numbers; `count`: how many.
  subroutine compare(claims, frame, orbit, signals, findings, count)
    type(claims_type), intent(in) :: claims
    type(frame_type), intent(in) :: frame
    type(orbit_type), intent(in) :: orbit
    type(signal_type), intent(in) :: signals(:)
    type(finding_type), allocatable, intent(out) :: findings(:)
    integer, intent(inout) :: count
    type(claim_type) :: claim
    integer :: k

    allocate(findings(0))
    call compare_multipliers(claims, orbit, findings, count)
    if (.not. allocated(claims%quantities)) return
    do k = 1, size(signals)
      claim = claim_of(claims, trim(signals(k)%name))
      ! Where psi is free the arm of the guides' forces may be left out, and no error be told: to go with that.
      if (signals(k)%name == "guide.m" .and. frame%machine%free(3) .and. .not. claim%error > 0) cycle
      if (allocated(claim%history)) call compare_signal(claim, signals(k), findings, count)
      if (signals(k)%name /= "probe(p).v") cycle
      call add(findings, count, "probe(p).v band", claims%band, 1000 * signals(k)%band(frame%period, &
        & real(frame%machine%band, xp)), claims%band_error, 1000 * (signals(k)%unknown + oracle_rounding * signals(k)%rms()))
    end do
    call compare_places(claims, frame, signals, findings, count)
  end subroutine compare

  !> Every multiplier within its bound, in the pairing that keeps most of them there.
  subroutine compare_multipliers(claims, orbit, findings, count)
    type(claims_type), intent(in) :: claims
    type(orbit_type), intent(in) :: orbit
    type(finding_type), allocatable, intent(inout) :: findings(:)
    integer, intent(inout) :: count
    real(dp) :: cost(size(claims%rho), size(claims%rho)), bound, noise
    integer :: pair(size(claims%rho)), j, k, n

    n = size(claims%rho)
    noise = 100 * real(epsilon(1.0_xp), dp) * maxval(real(abs(orbit%turn%change(:, :n)), dp))
    do k = 1, n
      do j = 1, n
        bound = claims%rho_error(k) * abs(claims%rho(k)) + noise
        cost(k, j) = real(abs(claims%rho(k) - orbit%rho(j)), dp) / max(bound, tiny(bound))
      end do
    end do
    cost = min(cost, 1.0e30_dp)
    pair = partners(cost)
    do k = 1, n
      count = count + 1
      findings = [findings, finding_type("multiplier, abs(difference)", abs(claims%rho(k)), real(abs(orbit%rho(pair(k))), dp), &
        & claims%rho_error(k) * abs(claims%rho(k)), cost(k, pair(k)))]
    end do
  end subroutine compare_multipliers

  subroutine compare_signal(claim, signal, findings, count)
    type(claim_type), intent(in) :: claim
    type(signal_type), intent(in) :: signal
    type(finding_type), allocatable, intent(inout) :: findings(:)
    integer, intent(inout) :: count
    real(xp) :: peak, own, at
    integer :: k, n

    peak = signal%peak()
    own = signal%unknown + oracle_rounding * peak
    n = size(claim%history) - 1
    do k = 0, n - 1
      at = signal%at(1 + k * size(signal%samples, 1) / n)
      call add(findings, count, trim(signal%name) // " history", claim%history(k + 1), at, claim%error, own)
    end do
    call add(findings, count, trim(signal%name) // " peak", claim%peak, peak, claim%peak_error, own)
    if (signal%name /= "torque") call add(findings, count, trim(signal%name) // " rms", claim%rms, signal%rms(), claim%error, own)
    do k = 1, size(claim%amplitudes)
      ! An error e at every time has harmonics of at most sqrt(2) e, by Parseval's theorem.
      call add(findings, count, trim(signal%name) // " harmonic", claim%amplitudes(k), signal%amplitude(k), &
        & sqrt(2.0_dp) * claim%error, own)
    end do
  end subroutine compare_signal

  !> Static forces to 1e-12 of the weight, for they have no bound of their own; least compressions.
  subroutine compare_places(claims, frame, signals, findings, count)
    type(claims_type), intent(in) :: claims
    type(frame_type), intent(in) :: frame
    type(signal_type), intent(in) :: signals(:)
    type(finding_type), allocatable, intent(inout) :: findings(:)
    integer, intent(inout) :: count
    complex(xp) :: static, down
    type(signal_type) :: along
    integer :: j, k, m, status

    if (.not. abs(frame%gravity) > 0) return
    down = frame%gravity / abs(frame%gravity)
    do k = 1, size(claims%places)
      read (claims%places(k)%name, *, iostat=status) j
      if (status /= 0) cycle
      static = sum(frame%springs(2 * j - 1:2 * j)%axis * frame%springs(2 * j - 1:2 * j)%static)
      call add(findings, count, "static_fx", claims%places(k)%static(1), real(static), &
        & real(1.0e-12_xp * frame%mass * abs(frame%gravity), dp), 0.0_xp)
      call add(findings, count, "static_fy", claims%places(k)%static(2), aimag(static), &
        & real(1.0e-12_xp * frame%mass * abs(frame%gravity), dp), 0.0_xp)
      do m = 1, size(signals)
        if (signals(m)%name /= "support(" // trim(claims%places(k)%name) // ").f") cycle
        allocate(along%samples(size(signals(m)%samples, 1), 1), along%c(0:ubound(signals(m)%c, 1), 1))
        along%samples(:, 1) = real(down) * signals(m)%samples(:, 1) + aimag(down) * signals(m)%samples(:, 2)
        along%c(:, 1) = real(down) * signals(m)%c(:, 1) + aimag(down) * signals(m)%c(:, 2)
        call add(findings, count, "support(" // trim(claims%places(k)%name) // ") least", claims%places(k)%least, &
          & along%least() + real(static * conjg(down)), claims%places(k)%least_error, signals(m)%unknown + oracle_rounding &
          & * (along%peak() + abs(static)))
        deallocate(along%samples, along%c)
      end do
    end do
  end subroutine compare_places

  !> A number with its bound, and what the oracle itself may miss.
  subroutine add(findings, count, what, claimed, true, bound, own)
    type(finding_type), allocatable, intent(inout) :: findings(:)
    integer, intent(inout) :: count
    character(len=*), intent(in) :: what
    real(dp), intent(in) :: claimed, bound
    real(xp), intent(in) :: true, own
    real(dp), parameter :: noted = 0.3_dp
    real(dp) :: used

    count = count + 1
    used = real(max(abs(claimed - true) - own, 0.0_xp) / max(real(bound, xp), tiny(1.0_xp)), dp)
    if (.not. abs(claimed - true) - own > 0) used = 0
    if (.not. abs(claimed) <= huge(claimed)) used = huge(used)
    if (used > noted) findings = [findings, finding_type(what, claimed, real(true, dp), bound, used)]
  end subroutine add

  !> Whether the verdict contradicts the greatest modulus.
  pure logical function verdict_is_wrong(claims, orbit) result(wrong)
    type(claims_type), intent(in) :: claims
    type(orbit_type), intent(in) :: orbit
    real(qp) :: excess

    excess = maxval(abs(orbit%rho)) - 1
    wrong = (claims%verdict == "stable" .and. excess > 1.0e-16_qp) .or. (claims%verdict == "unstable" .and. excess < -1.0e-16_qp)
  end function verdict_is_wrong

end module exact_check

!> The grammar: the groups that say what is to be computed, small enough to be computed by the hundred thousand.
module fuzz_orders
  use fuzz_dice, only: dice_type
  use fuzz_machine, only: scale_type
  use fuzz_values, only: name_word, real_word, source_type, whole_word
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  implicit none (type, external)
  private

  public :: all_tasks, draw_orders, parameter_path, quantity_name

  !> The cheap ones first, then those over parameters, then those that take seconds.
  character(len=*), parameter :: all_tasks(*) = [character(len=11) :: "stability", "modes", "response", "forces", "power", &
    & "drawing", "separation", "balance", "sweep", "boundary", "sensitivity", "resonance", "critical", "campbell", "trade"]
  integer, parameter :: cheap = 8
  character(len=*), parameter :: methods(*) = [character(len=9) :: "auto", "gauss2", "gauss3", "gauss4", "gauss6", "gauss8", &
    & "gauss10", "magnus4", "magnus6", "explicit8", "rk4", "reduced"]
  character, parameter :: newline = new_line("a")

contains

  !> All groups but those of the machine.
  subroutine draw_orders(source, scale, words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=:), allocatable, intent(out) :: words
    character(len=:), allocatable :: tasks, task
    real(dp) :: kind
    integer :: i

    associate (dice => source%dice)
      kind = dice%uniform()
      words = ""
      if (kind < 0.80_dp) then
        tasks = "'" // dice%pick(all_tasks(:cheap)) // "'"
        do i = 1, dice%below(4)
          tasks = tasks // ",'" // dice%pick(all_tasks(:cheap)) // "'"
        end do
      else if (kind < 0.96_dp) then
        tasks = "'sweep'"
        if (dice%chance(0.2_dp)) tasks = tasks // ",'" // dice%pick(all_tasks(:cheap)) // "'"
        words = sweeps(source, scale)
      else if (kind < 0.985_dp) then
        tasks = "'boundary'"
        if (dice%chance(0.2_dp)) tasks = "'boundary','sweep'"
        words = sweeps(source, scale) // "&boundary tolerance=" // real_word(source, dice%decades(-10.0_dp, -1.0_dp)) // " /" &
          & // newline
      else if (kind < 0.999_dp) then
        tasks = "'sensitivity'"
        words = "&sensitivity parameters='" // parameter_path(source, scale) // "', quantities='" // quantity_name(source, scale) &
          & // "' /" // newline
      else if (kind < 0.99995_dp) then
        task = dice%pick(all_tasks(12:14))
        tasks = "'" // task // "'"
        words = speeds(source, scale)
      else
        tasks = "'trade'"
      end if
      if (dice%chance(source%wild)) tasks = tasks // "," // dice%pick([character(len=12) :: "'stabilty'", "''", "'sweep'", &
        & "'campbell'", "'all'"])
      words = words // "&case tasks=" // tasks
      if (dice%chance(0.3_dp)) words = words // ", title=" // name_word(source, "A title")
      words = words // " /" // newline // "&response points=" // whole_word(source, 1 + dice%below(8)) // ", harmonics=" &
        & // whole_word(source, dice%below(5)) // " /" // newline // accuracy(source)
      if (dice%chance(0.12_dp)) then
        words = words // "&model coefficients=" // name_word(source, dice%pick(["averaged", "periodic"])) // " /" // newline
      else if (dice%chance(0.6_dp)) then
        words = words // "&model frame=" // name_word(source, dice%pick([character(len=11) :: "rest", "rest", "first_order", &
          & "exact"])) // " /" // newline
      else if (dice%chance(0.05_dp)) then
        words = words // "&model vibrations=" // name_word(source, "all") // " /" // newline
      end if
      if (dice%chance(0.15_dp)) words = words // "&gravity acceleration=" // real_word(source, 9.8_dp) // ", direction=" &
        & // real_word(source, -80.0_dp) // " /" // newline
    end associate
  end subroutine draw_orders

  !> Tolerance, method and steps, in a third of the cases.
  function accuracy(source) result(words)
    type(source_type), intent(inout) :: source
    character(len=:), allocatable :: words, method
    real(dp) :: least

    words = ""
    associate (dice => source%dice)
      if (dice%chance(0.65_dp)) return
      words = "&accuracy"
      method = ""
      least = -15
      if (dice%chance(0.6_dp)) then
        method = dice%pick(methods)
        ! methods of low order take a million steps to a small tolerance
        if (any(method == [character(len=7) :: "gauss2", "gauss3", "magnus4", "rk4"])) least = -5
        method = " method=" // name_word(source, method) // ","
      end if
      if (least > -6) words = words // " tolerance=" // real_word(source, dice%decades(least, -1.0_dp)) // ","
      if (least < -6 .and. dice%chance(0.6_dp)) words = words // " tolerance=" &
        & // real_word(source, dice%decades(least, -1.0_dp)) // ","
      words = words // method
      if (dice%chance(0.3_dp)) words = words // " steps=" // whole_word(source, int(dice%decades(0.0_dp, 2.5_dp))) // ","
      words = words // " /" // newline
    end associate
  end function accuracy

  !> One or two groups &sweep about the values that the grammar draws.
  function sweeps(source, scale) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=:), allocatable :: words
    real(dp) :: from
    integer :: i

    words = ""
    associate (dice => source%dice)
      do i = 1, dice%pick_of([1, 1, 2])
        if (dice%chance(0.5_dp)) then
          words = words // "&sweep parameter='drive.speed_rpm'"
          from = scale%speed
        else
          words = words // "&sweep parameter='" // parameter_path(source, scale) // "'"
          from = dice%pick_of([scale%mass, scale%stiffness, scale%length, scale%damping, 0.0_dp, dice%decades(-6.0_dp, 6.0_dp)])
        end if
        words = words // ", from=" // real_word(source, from) // ", to=" // real_word(source, from &
          & * dice%pick_of([1.01_dp, 1.1_dp, 2.0_dp, 10.0_dp, 0.5_dp, 1000.0_dp, -1.0_dp])) // ", count=" // whole_word(source, &
          & dice%pick_of([1, 2, 2, 3, 3, 4, 5, 9]))
        if (dice%chance(0.3_dp)) words = words // ", spacing=" // name_word(source, dice%pick(["log   ", "linear"]))
        if (dice%chance(0.3_dp)) words = words // ", engine=" // name_word(source, dice%pick([character(len=9) :: "auto", &
          & "direct", "expansion"]))
        if (dice%chance(0.3_dp)) words = words // ", columns=" // dice%pick([character(len=40) :: "'rho_max'", "'verdict'", &
          & "'log_rho_max','rho_error'", "'xi_peak_m','psi_peak_rad'", "'rho_max','verdict','eta_peak_m'"])
        words = words // " /" // newline
      end do
    end associate
  end function sweeps

  !> A narrow range of speeds, and what is looked at.
  function speeds(source, scale) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=:), allocatable :: words

    associate (dice => source%dice)
      words = "&sweep parameter='drive.speed_rpm', from=" // real_word(source, scale%speed) // ", to=" // real_word(source, &
        & scale%speed * dice%pick_of([1.001_dp, 1.01_dp, 1.1_dp, 1.2_dp, 0.9_dp])) // ", count=" // whole_word(source, &
        & 2 + dice%below(3)) // " /" // newline // "&resonance orders=" // whole_word(source, 1 + dice%below(2))
      if (dice%chance(0.8_dp)) words = words // ", quantities='" // quantity_name(source, scale) // "'"
      words = words // " /" // newline
    end associate
  end function speeds

  !> The path of a number, of this machine or none.
  function parameter_path(source, scale) result(path)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=:), allocatable :: path
    character(len=*), parameter :: common(*) = [character(len=26) :: "frame.mass", "frame.inertia", "support.stiffness", &
      & "support.damping", "support(1).stiffness(1)", "support(1).angle", "frame.origin(1)", "foundation.damping(3)", &
      & "foundation.stiffness(1,1)", "link(L1).mass", "link(L1).inertia", "joint(J2).radius", "joint(J2).phase", &
      & "joint(J3).lengths(1)", "joint(J3).lengths(2)", "joint(J1).position(1)", "joint(J4).guide_angle", &
      & "mass_functions.a1(2)", "mass_functions.mass", "link.mass", "support.position(2)", "joint(J3).branch", &
      & "frame.dof", "response.points", "probe(P1).position(1)"]

    path = source%dice%pick(common(:merge(6, size(common), scale%supports > 0 .and. source%dice%chance(0.5_dp))))
    if (source%dice%chance(source%wild)) path = source%dice%pick([character(len=26) :: "", "frame", "frame.", ".mass", &
      & "link(.mass", "support(99).stiffness", "support(0).stiffness", "joint(J2).radius(2)", "Drive.SPEED_RPM", "sweep.from", &
      & "support(1.stiffness", "frame.mass=3", "support(99999999999).angle", "link(L1)mass", "case.title"])
  end function parameter_path

  !> The name of a quantity.
  function quantity_name(source, scale) result(name)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=:), allocatable :: name
    character(len=*), parameter :: names(*) = [character(len=16) :: "f", "fx", "fy", "m", "xi", "eta", "psi", "xi_dot", &
      & "psi_dot", "foundation.fx", "guide.f", "guide.m", "support(1).f", "support(1).fx"]
    character(len=*), parameter :: of_probe(*) = [character(len=12) :: "probe(P1).v", "probe(P1).x", "probe(P1).ay", "probe(P1).a"]

    if (scale%probes > 0 .and. source%dice%chance(0.4_dp)) then
      name = source%dice%pick(of_probe)
    else
      name = source%dice%pick(names)
    end if
    if (source%dice%chance(source%wild)) name = source%dice%pick([character(len=16) :: "support(9).f", "probe(X).v", "g", "", &
      & "support().f", "guide.q"])
  end function quantity_name

end module fuzz_orders

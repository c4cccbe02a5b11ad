!> The grammar: the groups that say what is to be computed, small enough to be computed by the hundred thousand.
module fuzz_orders
  use fuzz_dice, only: dice_type
  use fuzz_schema, only: long_tasks, own_groups, parameter_path, quantity_name, quick_tasks, tasks
  use fuzz_values, only: name_word, real_word, scale_type, source_type, whole_word
  use gestell_base_kinds, only: dp
  use gestell_floquet_solution_part, only: solution_methods
  implicit none (type, external)
  private

  public :: draw_orders

  character, parameter :: newline = new_line("a")

contains

  !> All groups but those of the machine.
  subroutine draw_orders(source, scale, words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=:), allocatable, intent(out) :: words
    character(len=:), allocatable :: list, task
    real(dp) :: kind
    integer :: i

    associate (dice => source%dice)
      kind = dice%uniform()
      words = ""
      if (kind < 0.80_dp) then
        list = "'" // dice%pick(quick_tasks) // "'"
        do i = 1, dice%below(4)
          list = list // ",'" // dice%pick(quick_tasks) // "'"
        end do
      else if (kind < 0.95_dp) then
        list = "'sweep'"
        if (dice%chance(0.2_dp)) list = list // ",'" // dice%pick(quick_tasks) // "'"
      else
        list = "'" // dice%pick(long_tasks) // "'"
        if (dice%chance(0.2_dp)) list = list // ",'" // dice%pick(tasks) // "'"
      end if
      if (dice%chance(source%wild)) list = list // "," // dice%pick([character(len=12) :: "'stabilty'", "''", "'sweep'", &
        & "'campbell'", "'all'"])
      do i = 1, size(tasks)
        task = trim(tasks(i))
        if (any(tasks(:i - 1) == task) .or. index(list, "'" // task // "'") == 0) cycle
        words = words // own_groups(source, scale, task)
        if (all(quick_tasks /= task) .and. index(words, "&sweep") == 0) words = words // ranges(source, scale, task)
      end do
      words = words // "&case tasks=" // list
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

  !> The ranges over which a task that takes long looks at machines, and what the task is told of them.
  function ranges(source, scale, task) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=*), intent(in) :: task
    character(len=:), allocatable :: words

    words = ""
    select case (task)
    case ("sweep", "boundary")
      words = sweeps(source, scale)
      if (task == "boundary") words = words // "&boundary tolerance=" &
        & // real_word(source, source%dice%decades(-10.0_dp, -1.0_dp)) // " /" // newline
    case default
      ! a design, a sensitivity may do without
      if (source%dice%chance(0.6_dp)) words = speeds(source, scale)
    end select
  end function ranges

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
        method = dice%pick(solution_methods())
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

end module fuzz_orders

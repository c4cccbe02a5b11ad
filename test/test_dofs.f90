!> Every task runs with every set of degrees of freedom, one to six, and a quantity has the same value in all tasks that report
!> it.
module test_dofs
  use checks, only: check_success, check_that
  use dofs_machines, only: critical_range, last_plane, last_space, machine_of, names_of, orders_of, ranges_of
  use gestell, only: dp, gestell_error => error_type, machine_type, solution_type, table_type
  use gestell_base_text, only: exact
  use gestell_output_table, only: column_type
  use gestell_task_common_task, only: all_machines, all_speeds, any_task_type
  use gestell_task_registry, only: all_tasks
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: collect_dofs

  !> A claim of a task about a quantity: its name, such as f_peak; where it is reported; value and a bound on its error.
  type :: claim_type
    character(len=40) :: what = ""
    character(len=16) :: place = ""
    real(dp) :: value = 0, error = 0
  end type claim_type

  type :: claims_type
    type(claim_type), allocatable :: list(:)
    !> The table that is read.
    character(len=16) :: place = ""
  contains
    procedure :: add
    procedure :: place_of
    procedure :: value_of
  end type claims_type

contains

  subroutine collect_dofs(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_slow("all tasks agree on all quantities for every set of degrees of freedom", test_all_sets), &
      & new_unittest("quantities of a plane machine exist for the same machine in space", test_names)]
  end subroutine collect_dofs

  subroutine test_all_sets(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: what
    type(claims_type) :: claims
    integer :: set, forces, compared
    real(dp) :: shaking(0:2)

    forces = 0
    shaking = -1
    do set = 1, last_space
      call solve_set(set, claims, what, error)
      if (.not. allocated(error)) call agree(claims, what, compared, error)
      if (.not. allocated(error)) call compare_critical(set, claims, forces, what, error)
      if (allocated(error)) return
      ! The moment on a frame at rest does not depend on the degrees of freedom, nor on whether they are in the plane. Holders
      ! of the speed take turns.
      associate (moment => shaking(modulo(set, 3)), found => claims%value_of("shaking.m_rms"))
        if (moment < 0) moment = found
        call check_that(error, abs(found - moment), "<=", 1.0e-13_dp * moment, what // ": shaking.m")
      end associate
      ! all tasks that report quantities have been read: the first sets have 20 quantities in quantities, 8 elsewhere, twice
      call check_that(error, compared, ">=", 100, what // ": number of compared claims")
      if (allocated(error)) return
    end do
    ! Four of 13, 28, 43, 48, 53 and 63, whose mode has a peak within the range, have one of the force too.
    call check_that(error, forces, "==", 4, "sets with a critical speed")
  end subroutine test_all_sets

  !> Solves the machine with a set of degrees of freedom by all tasks, alone and over a range, and collects their claims.
  subroutine solve_set(set, claims, what, error)
    integer, intent(in) :: set
    type(claims_type), intent(out) :: claims
    character(len=:), allocatable, intent(out) :: what
    type(error_type), allocatable, intent(out) :: error
    type(any_task_type), allocatable :: tasks(:)
    character(len=:), allocatable :: own, others, text
    integer :: i

    call all_tasks(tasks)
    own = ""
    others = ""
    do i = 1, size(tasks)
      ! This study solves each machine dozens of times: only sets of all sizes, twice.
      if (tasks(i)%task%name == "trade" .and. .not. any(set == [1, 3, 7, 15, 31, 63, 32, 48, 56, 60, 62])) cycle
      if (set > last_plane .and. .not. takes_its_turn(tasks(i)%task%name)) cycle
      if (any(tasks(i)%task%scope == [all_machines, all_speeds])) then
        if (index(others, "'" // trim(tasks(i)%task%name) // "'") == 0) others = others // ",'" // trim(tasks(i)%task%name) // "'"
      else
        if (index(own, "'" // trim(tasks(i)%task%name) // "'") == 0) own = own // ",'" // trim(tasks(i)%task%name) // "'"
      end if
    end do
    allocate(claims%list(0))
    text = machine_of(set)
    what = "dof=" // names_of(set)
    call solve(text // orders_of(set) // "&case tasks=" // own(2:) // " /", "alone, " // what)
    if (.not. allocated(error)) call solve(text // ranges_of(set) // "&case tasks=" // others(2:) // " /", "over a range, " // what)

  contains

    !> The tasks that take longest over a range report no quantities that other tasks report, but must not fail: they take turns.
    !> Where `compare_critical` compares a force, `critical` runs.
    pure logical function takes_its_turn(name)
      character(len=*), intent(in) :: name

      select case (name)
      case ("critical")
        takes_its_turn = modulo(set, 5) == 3
      case ("campbell")
        takes_its_turn = any(modulo(set, 5) == [0, 2])
      case ("boundary")
        takes_its_turn = any(modulo(set, 5) == [1, 4])
      case default
        takes_its_turn = .true.
      end select
    end function takes_its_turn

    subroutine solve(input, label)
      character(len=*), intent(in) :: input, label
      type(machine_type) :: machine
      type(solution_type) :: solution
      type(gestell_error), allocatable :: failure
      integer :: k

      call machine%parse(input, failure)
      if (.not. allocated(failure)) call machine%solve(solution, failure)
      call check_success(error, failure, label)
      if (allocated(error)) return
      if (allocated(solution%result%failure)) then
        call test_failed(error, label // ": " // solution%result%failure%message)
        return
      end if
      do k = 1, size(solution%result%tables)
        call collect(solution%result%tables(k), solution%result%tables(k)%name, set, claims)
      end do
      call collect(solution%result%brief, "brief", set, claims)
    end subroutine solve

  end subroutine solve_set

  !> Adds the claims of a table about the machine at its operating speed.
  subroutine collect(table, place, set, claims)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: place
    integer, intent(in) :: set
    type(claims_type), intent(inout) :: claims
    character(len=*), parameter :: measures(2) = ["peak", "rms "], &
      & parts(7) = [character(len=2) :: "fx", "fy", "f", "m", "fz", "mx", "my"]
    character(len=:), allocatable :: name
    integer :: i, k

    claims%place = place
    select case (place)
    case ("quantities", "design_goals")
      name = merge("value ", "before", place == "quantities")
      do i = 1, table%rows
        call claims%add(table, i, word_of(table, "quantity", i) // "_" // word_of(table, "measure", i), trim(name), &
          & trim(merge("error       ", "before_error", place == "quantities")))
      end do
    case ("supports")
      do i = 1, table%rows
        name = word_of(table, "support", i)
        if (verify(name, "0123456789") == 0) name = "support(" // name // ")"
        do k = 1, size(parts)
          if (index(name, "support") == 1 .and. index(parts(k), "m") == 1) cycle
          associate (part => parts(k)(:len_trim(parts(k))))
            call claims%add(table, i, name // "." // part // "_peak", part // "_peak", part // "_peak_error")
            call claims%add(table, i, name // "." // part // "_rms", part // "_rms")
          end associate
        end do
      end do
    case ("probes")
      call claims%add(table, 1, "probe(p).v_peak", "v_peak", "v_peak_error")
      call claims%add(table, 1, "probe(p).d_rms", "d_rms")
      call claims%add(table, 1, "probe(p).ax_peak", "ax_peak", "ax_peak_error")
      call claims%add(table, 1, "probe(p).v_band", "v_rms_band", "v_rms_band_error")
    case ("sensitivity")
      do i = 1, table%rows
        do k = 1, 2
          call claims%add(table, i, word_of(table, "quantity", i) // "_" // trim(measures(k)), trim(measures(k)))
        end do
      end do
    case ("balance")
      call claims%add(table, 1, "total.f_rms", "f_rms", "f_rms_error")
      call claims%add(table, 1, "total.f_peak", "f_peak", "f_peak_error")
      call claims%add(table, 1, "shaking.f_rms", "rigid_f_rms")
      call claims%add(table, 1, "psi_peak", "psi_peak", "psi_peak_error")
      ! in space the size of the vector
      if (set > last_plane) return
      call claims%add(table, 1, "total.m_rms", "m_rms", "m_rms_error")
      call claims%add(table, 1, "total.m_peak", "m_peak", "m_peak_error")
      call claims%add(table, 1, "shaking.m_rms", "rigid_m_rms")
    case ("multipliers")
      call claims%add(table, 1, "rho_max_", "abs")
    case ("critical")
      do i = 1, table%rows
        if (claims%value_of("critical force") > 0) exit
        call claims%add(table, i, "critical force", "force")
        call claims%add(table, i, "critical speed", "force_speed")
      end do
    case ("resonance", "sweep", "brief")
      do k = 1, size(table%columns)
        name = name_of(table%columns(k))
        if (.not. allocated(table%columns(k)%numbers) .or. index(name, "_error") > 0) cycle
        call claims%add(table, 1, name // repeat("_", merge(1, 0, name == "rho_max")), name, name // "_error")
      end do
    case default
      continue
    end select
  end subroutine collect

  !> Adds the claim about `what` in row `i` of a table, by its columns for the value and, if there is one, its error.
  subroutine add(self, table, i, what, value, bound)
    class(claims_type), intent(inout) :: self
    type(table_type), intent(in) :: table
    integer, intent(in) :: i
    character(len=*), intent(in) :: what, value
    character(len=*), intent(in), optional :: bound
    type(claim_type) :: claim
    integer :: k

    do k = 1, size(table%columns)
      if (.not. allocated(table%columns(k)%numbers)) cycle
      if (.not. ieee_is_finite(table%columns(k)%numbers(i))) cycle
      if (name_of(table%columns(k)) == value) then
        claim%what = what
        claim%place = self%place
        claim%value = abs(table%columns(k)%numbers(i))
      else if (present(bound)) then
        if (name_of(table%columns(k)) == bound) claim%error = table%columns(k)%numbers(i)
      end if
    end do
    if (index(claim%what, "f_") == 1) claim%what = "total." // trim(claim%what)
    if (claim%what /= "") self%list = [self%list, claim]
  end subroutine add

  !> The name of a column without its unit.
  pure function name_of(column) result(name)
    type(column_type), intent(in) :: column
    character(len=:), allocatable :: name

    name = column%key
    if (column%unit%suffix /= "") name = name(:len(name) - len_trim(column%unit%suffix) - 1)
  end function name_of

  function word_of(table, label, i) result(word)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: label
    integer, intent(in) :: i
    character(len=:), allocatable :: word
    integer :: k

    word = ""
    do k = 1, size(table%columns)
      if (table%columns(k)%key == label) word = trim(table%columns(k)%word(i))
    end do
  end function word_of

  !> The first claim of a table about `what`; -1: there is none.
  pure real(dp) function value_of(self, what) result(value)
    class(claims_type), intent(in) :: self
    character(len=*), intent(in) :: what
    integer :: first

    first = self%place_of(what)
    value = -1
    if (first > 0) value = self%list(first)%value
  end function value_of

  !> Index of the first claim about `what`; 0: there is none.
  pure integer function place_of(self, what) result(place)
    class(claims_type), intent(in) :: self
    character(len=*), intent(in) :: what

    do place = 1, size(self%list)
      if (self%list(place)%what == what) return
    end do
    place = 0
  end function place_of

  !> Compares every claim with the first claim about the same quantity, within the errors that both report.
  subroutine agree(claims, what, compared, error)
    type(claims_type), intent(in) :: claims
    character(len=*), intent(in) :: what
    integer, intent(out) :: compared
    type(error_type), allocatable, intent(out) :: error
    !> Error of tables without a column of errors: the solution's tolerance, 1e-7, times ten for the condition of these
    !> machines.
    real(dp), parameter :: untold = 1.0e-6_dp
    real(dp) :: allowed
    integer :: i, first

    compared = 0
    do i = 1, size(claims%list)
      associate (claim => claims%list(i))
        first = claims%place_of(claim%what)
        if (first == i) cycle
        compared = compared + 1
        associate (other => claims%list(first))
          allowed = 2 * (claim%error + other%error)
          if (.not. min(claim%error, other%error) > 0) allowed = allowed + untold * claim%value
          call check_that(error, abs(claim%value - other%value), "<=", allowed, what // ": " // trim(claim%what) // " in " &
            & // trim(other%place) // " and in " // trim(claim%place) // ", " // exact(other%value) // " and " &
            & // exact(claim%value))
        end associate
        if (allocated(error)) return
      end associate
    end do
  end subroutine agree

  !> The force at a critical speed agrees with the one that the task `forces` reports there; `count`: number of sets with a
  !> critical speed. Every fifth set is searched.
  subroutine compare_critical(set, claims, count, what, error)
    integer, intent(in) :: set
    type(claims_type), intent(inout) :: claims
    integer, intent(inout) :: count
    character(len=*), intent(in) :: what
    type(error_type), allocatable, intent(out) :: error
    !> The peak lies between samples, and the solutions have other steps with the tolerance of 1e-7 and a condition of about ten.
    real(dp), parameter :: part = 1.0e-6_dp
    type(machine_type) :: machine
    type(solution_type) :: solution
    type(table_type) :: table
    type(gestell_error), allocatable :: failure

    if (modulo(set, 5) /= 3) return
    ! Critical speeds refer to vibrations about rest.
    call machine%parse(machine_of(set, "rest") // critical_range, failure)
    if (.not. allocated(failure)) call machine%solve(solution, failure, "critical")
    if (.not. allocated(failure)) call solution%table("critical", table, failure)
    call check_success(error, failure, "critical speeds, " // what)
    if (allocated(error)) return
    call collect(table, "critical", set, claims)
    if (claims%value_of("critical force") < 0) return
    count = count + 1
    call machine%parse(machine_of(set, "rest"), failure)
    if (.not. allocated(failure)) call machine%set("drive.speed_rpm", claims%value_of("critical speed"), failure)
    if (.not. allocated(failure)) call machine%solve(solution, failure, "forces")
    if (.not. allocated(failure)) call solution%table("supports", table, failure)
    call check_success(error, failure, "at the critical speed, " // what)
    if (allocated(error)) return
    call claims%add(table, table%rows, "found", "f_peak")
    associate (found => claims%value_of("found"), force => claims%value_of("critical force"))
      call check_that(error, abs(found - force), "<=", part * force, what // ": critical force " // exact(force) &
        & // ", in supports " // exact(found))
    end associate
  end subroutine compare_critical

  !> All tasks look up quantities in one place: quantities of a plane machine, with their units, exist for the same machine in
  !> space.
  subroutine test_names(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: names(*) = [character(len=16) :: "xi", "psi_dot", "psi_ddot", "fx", "m", "f", "total.m", &
      & "guide.fx", "foundation.m", "support(1).fy", "probe(p).x", "probe(p).v", "probe(p).ay"]
    type(machine_type) :: machine
    type(solution_type) :: solution
    type(gestell_error), allocatable :: failure
    type(table_type) :: tables(2)
    character(len=:), allocatable :: list
    integer :: i, k

    list = ""
    do i = 1, size(names)
      list = list // ",'" // trim(names(i)) // "'"
    end do
    do k = 1, 2
      call machine%parse(machine_of(merge(7, 15, k == 1)) // "&response quantities=" // list(2:) // " /", failure)
      if (.not. allocated(failure)) call machine%solve(solution, failure, "response")
      if (.not. allocated(failure)) call solution%table("quantities", tables(k), failure)
      call check_success(error, failure)
      if (allocated(error)) return
    end do
    do i = 1, size(names)
      call check(error, word_of(tables(1), "unit", i), word_of(tables(2), "unit", i), more=names(i))
      if (allocated(error)) return
    end do
  end subroutine test_names

end module test_dofs

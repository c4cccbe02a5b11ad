!> Input number N: a document and a command line, a function of the seed and N alone.
module fuzz_input
  use gestell_run_command_line, only: word_type
  use fuzz_dice, only: dice_type, new_dice
  use fuzz_machine, only: draw_machine
  use fuzz_mutation, only: limited, mutate
  use fuzz_orders, only: draw_orders
  use fuzz_schema, only: add_any_group, parameter_path, quick_tasks
  use fuzz_text, only: read_content, has, newline
  use fuzz_values, only: scale_type, source_type, wild_name, wild_number
  use gestell_base_kinds, only: dp
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: draw_input, read_corpus, reduced_to

  type, public :: input_type
    type(word_type), allocatable :: words(:)
    character(len=:), allocatable :: document
    !> Names of the file and of the folder for the results, as the words give them.
    character(len=:), allocatable :: file, folder
    !> Whether the words have been changed, so that other names may stand there.
    logical :: garbled = .false.
  contains
    procedure :: option
  end type input_type

  character(len=*), parameter :: corpus_files(*) = [character(len=36) :: "data/khang_four_bar.nml", "data/shaper.nml", &
    & "data/khang_four_bar_printed.nml", "data/compressor.nml", "data/flying_press.nml", "data/watt_six_bar.nml", &
    & "data/rocking_sieve.nml", "data/sieve_borders.nml", "data/khang_chart.nml", "data/cam_press.nml", &
    & "data/inline_four.nml", "data/engine_in_space.nml", "data/v_twin.nml", "data/suspended_compressor.nml", &
    & "data/inline_twin.nml", "data/powertrain.nml", "example/sweep.nml"]

contains

  !> The project's own inputs, with orders that are quickly done. `root`: the project's folder.
  subroutine read_corpus(root, corpus)
    character(len=*), intent(in) :: root
    type(word_type), allocatable, intent(out) :: corpus(:)
    character(len=:), allocatable :: text
    logical :: there
    integer :: i

    allocate(corpus(size(corpus_files)))
    do i = 1, size(corpus)
      call read_content(root // "/" // trim(corpus_files(i)), text, there)
      if (.not. there) error stop "the project's inputs are not there: run it in the project's folder or in validation/fuzz"
      if (.not. has(text, "&response")) text = text // "&response points=5, harmonics=3 /" // newline
      corpus(i)%text = small(text)
    end do
  end subroutine read_corpus

  !> Counts of sweeps and points cut to few.
  function small(text) result(short)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: short
    integer :: at, digits

    short = text
    at = 0
    do
      digits = index(short(at + 1:), "count=")
      if (digits == 0) exit
      at = at + digits + 5
      digits = verify(short(at + 1:), "0123456789") - 1
      short = short(:at) // "4" // short(at + digits + 1:)
    end do
  end function small

  !> Input `number` from `seed`.
  subroutine draw_input(seed, number, corpus, input)
    integer(int64), intent(in) :: seed, number
    type(word_type), intent(in) :: corpus(:)
    type(input_type), intent(out) :: input
    type(source_type) :: source
    type(scale_type) :: scale
    character(len=:), allocatable :: orders, machine
    real(dp) :: kind
    integer :: base, lender

    source%dice = new_dice(seed, number)
    allocate(input%words(0))
    kind = source%dice%uniform()
    base = 1 + source%dice%below(size(corpus))
    lender = 1 + source%dice%below(size(corpus))
    if (kind < 0.6_dp) then
      source%wild = source%dice%pick_of([0.0_dp, 0.0_dp, 0.0_dp, 0.01_dp, 0.02_dp, 0.2_dp])
      call draw_machine(source, scale, machine)
      call draw_orders(source, scale, orders)
      input%document = orders // machine
      if (source%dice%chance(0.15_dp)) call add_any_group(source, scale, input%document)
    else
      input%document = corpus(base)%text
    end if
    if (kind > 0.5_dp .and. kind < 0.9_dp) call mutate(source%dice, input%document, corpus(lender)%text)
    if (kind > 0.9_dp .or. source%dice%chance(0.05_dp)) call add_settings(source, scale, input)
    if (source%dice%chance(0.99_dp)) input%document = limited(input%document)
    call add_options(source%dice, input)
    call name_files(source%dice, input)
    if (source%dice%chance(0.01_dp)) call garble(source%dice, input)
  end subroutine draw_input

  !> Up to three --set.
  subroutine add_settings(source, scale, input)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    type(input_type), intent(inout) :: input
    character(len=*), parameter :: paths(*) = [character(len=24) :: "drive.speed_rpm", "frame.mass", "frame.inertia", &
      & "support.stiffness", "support.damping", "support(1).stiffness(1)", "support(2).damping", "support.position(1)", &
      & "frame.origin", "link.mass", "link.inertia", "foundation.damping(1)", "foundation.damping(3)", "joint(B).lengths(1)", &
      & "joint(A).radius", "link(coupler).center(2)", "accuracy.tolerance", "accuracy.steps", "response.points", "frame.dof"]
    character(len=:), allocatable :: assignment, none
    integer :: i

    do i = 1, 1 + source%dice%below(3)
      if (source%dice%chance(0.15_dp)) then
        assignment = parameter_path(source, scale) // "="
      else
        assignment = source%dice%pick(paths) // "="
      end if
      if (source%dice%chance(0.15_dp)) then
        assignment = "case.tasks=" // source%dice%pick([quick_tasks, [character(len=16) :: "sweep"]])
      else if (source%dice%chance(0.1_dp)) then
        assignment = assignment // wild_name(source%dice)
      else
        assignment = assignment // wild_number(source%dice)
      end if
      none = ""
      if (source%dice%chance(0.1_dp)) call mutate(source%dice, assignment, none)
      assignment = limited(assignment)
      call add_word(input, "--set")
      call add_word(input, without_nul(assignment))
    end do
  end subroutine add_settings

  !> Options, in a third of the cases.
  subroutine add_options(dice, input)
    type(dice_type), intent(inout) :: dice
    type(input_type), intent(inout) :: input
    real(dp) :: kind

    kind = dice%uniform()
    if (kind < 0.04_dp) then
      call add_word(input, "-q")
    else if (kind < 0.12_dp) then
      call add_word(input, "--check")
    else if (kind < 0.22_dp) then
      call add_word(input, "--one-line")
    else if (kind < 0.24_dp) then
      call add_word(input, "--fail-if-unstable")
    else if (kind < 0.245_dp) then
      call add_word(input, "--part=" // dice%pick(["1/1", "1/2", "2/2", "9/9", "0/1", "2/1", "a/b", "1/ "]))
    else if (kind < 0.25_dp) then
      call add_word(input, "--merge")
    else if (kind < 0.2503_dp) then
      call add_word(input, dice%pick(["--report", "--plot  "]))
    else if (kind < 0.2530_dp) then
      input%garbled = .true.
      call add_word(input, dice%pick([character(len=12) :: "--help", "-V", "--chekc", "-x", "--part", "--quiet=1", "--set", &
        & "--", "-", "--=", "-o", "--output="]))
    end if
    if (dice%chance(0.02_dp)) call add_word(input, dice%pick(["--one-line", "--check   ", "-q        "]))
  end subroutine add_options

  subroutine add_word(input, word)
    type(input_type), intent(inout) :: input
    character(len=*), intent(in) :: word
    type(word_type), allocatable :: words(:)
    integer :: n

    n = size(input%words)
    allocate(words(n + 1))
    words(:n) = input%words
    words(n + 1)%text = word
    call move_alloc(words, input%words)
  end subroutine add_word

  !> The input's name and the folder for the results, and the words for them.
  subroutine name_files(dice, input)
    type(dice_type), intent(inout) :: dice
    type(input_type), intent(inout) :: input

    input%file = "input.nml"
    if (dice%chance(0.01_dp)) input%file = tame(dice, wild_name(dice)) // ".nml"
    input%folder = "out"
    if (dice%chance(0.01_dp)) input%folder = tame(dice, wild_name(dice))
    call add_word(input, "--output=" // input%folder)
    if (index(input%file, "-") == 1) call add_word(input, "--")
    call add_word(input, input%file)
  end subroutine name_files

  !> A name of a file within the folder.
  function tame(dice, name) result(word)
    type(dice_type), intent(inout) :: dice
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: word

    word = without_nul(name)
    if (len(word) > 100) word = word(:100)
    if (len_trim(word) == 0 .or. scan(word, "/") > 0 .or. index(word, ".") == 1) word = dice%pick(["a b  ", "x.y.z", "=    "])
  end function tame

  !> A word of the command line is lost, comes twice or changes.
  subroutine garble(dice, input)
    type(dice_type), intent(inout) :: dice
    type(input_type), intent(inout) :: input
    character(len=:), allocatable :: word, none
    integer :: k

    input%garbled = .true.
    k = 1 + dice%below(size(input%words))
    select case (dice%below(3))
    case (0)
      input%words = [input%words(:k - 1), input%words(k + 1:)]
    case (1)
      input%words = [input%words(:k), input%words(k:)]
    case default
      word = input%words(k)%text
      none = ""
      call mutate(dice, word, none)
      word = without_nul(word)
      ! no other folder than the one that is the fuzzer's
      if (scan(word, "/") > 0) word = "--part=1/2"
      input%words(k)%text = word
    end select
  end subroutine garble

  !> No word of a command line holds the character 0.
  pure function without_nul(text) result(word)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: word
    integer :: i

    word = ""
    do i = 1, len(text)
      if (ichar(text(i:i)) > 0) word = word // text(i:i)
    end do
  end function without_nul

  !> The same input with another document.
  function reduced_to(input, document) result(other)
    type(input_type), intent(in) :: input
    character(len=*), intent(in) :: document
    type(input_type) :: other

    other = input
    other%document = document
  end function reduced_to

  !> Whether an option is given.
  pure logical function option(self, name)
    class(input_type), intent(in) :: self
    character(len=*), intent(in) :: name
    integer :: i

    option = .false.
    do i = 1, size(self%words)
      if (index(self%words(i)%text, name) == 1) option = .true.
    end do
  end function option

end module fuzz_input

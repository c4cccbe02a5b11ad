!> Tasks, groups and keys as the program's registry has them, and groups drawn from their records. A new task, group or key is
!> fuzzed without a change here.
module fuzz_schema
  use fuzz_text, only: has
  use fuzz_values, only: name_word, real_word, scale_type, source_type, whole_word
  use gestell_base_key, only: all_words, integer_key, key_type, of_angle, of_damping, of_force, of_inertia, of_length, of_mass, &
    & of_moment, of_rotary_damping, of_stiffness, real_key, unset
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_input_schema, only: schema_type
  use gestell_task_common_task, only: any_task_type, own_machine, unsolved_machine
  use gestell_task_registry, only: all_tasks, input_schema
  implicit none (type, external)
  private

  public :: add_any_group, draw_group, load_registry, own_groups, parameter_path, quantity_name

  !> The names of all tasks; of those about the machine of the input that take milliseconds; of all others.
  character(len=16), allocatable, protected, public :: tasks(:), quick_tasks(:), long_tasks(:)
  type(schema_type), allocatable, protected :: schema

  !> Tasks about the machine of the input that solve hundreds of machines. They are drawn less often, for time alone.
  character(len=*), parameter :: many_solutions(*) = [character(len=11) :: "trade", "sensitivity", "design"]
  character, parameter :: newline = new_line("a")

contains

  !> Takes tasks and schema from the program. To be called once, before anything is drawn.
  subroutine load_registry()
    type(any_task_type), allocatable :: listed(:)
    logical, allocatable :: quick(:)
    integer :: i

    call all_tasks(listed)
    schema = input_schema()
    tasks = [character(len=16) :: (listed(i)%task%name, i = 1, size(listed))]
    quick = [((listed(i)%task%scope == own_machine .or. listed(i)%task%scope == unsolved_machine) .and. &
      & all(many_solutions /= listed(i)%task%name), i = 1, size(listed))]
    quick_tasks = pack(tasks, quick)
    long_tasks = pack(tasks, .not. quick)
  end subroutine load_registry

  !> The groups that a task adds to the schema, drawn; empty where it has none.
  function own_groups(source, scale, task) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=*), intent(in) :: task
    character(len=:), allocatable :: words
    type(any_task_type), allocatable :: listed(:)
    type(schema_type) :: own
    integer :: i, k, copies

    words = ""
    call all_tasks(listed)
    do i = 1, size(listed)
      if (listed(i)%task%name /= task) cycle
      own = schema_type(schema%groups(:0), schema%keys(:0), schema%variants(:0))
      call listed(i)%task%extend(own)
      do k = 1, size(own%groups)
        copies = 1
        if (own%groups(k)%repeatable) copies = source%dice%pick_of([1, 1, 1, 2, 3])
        if (source%dice%chance(0.15_dp)) copies = 0
        do copies = copies, 1, -1
          words = words // draw_group(source, scale, trim(own%groups(k)%name))
        end do
      end do
    end do
  end function own_groups

  !> Adds one group of the schema, whichever it is, to a document. Most groups that the document has already and must not repeat
  !> are passed over.
  subroutine add_any_group(source, scale, document)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=:), allocatable, intent(inout) :: document
    integer :: i

    i = 1 + source%dice%below(size(schema%groups))
    if (has(document, "&" // trim(schema%groups(i)%name)) .and. .not. schema%groups(i)%repeatable) then
      if (source%dice%chance(0.95_dp)) return
    end if
    document = document // draw_group(source, scale, trim(schema%groups(i)%name))
  end subroutine add_any_group

  !> A group of that name with the keys that it must have and some of the others.
  function draw_group(source, scale, name) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: words
    logical :: needed, drawn
    integer :: i

    words = "&" // name
    do i = 1, size(schema%keys)
      associate (key => schema%keys(i))
        if (key%group /= name) cycle
        needed = key%default <= unset .and. key%word == "" .and. key%otherwise == ""
        drawn = source%dice%chance(merge(0.98_dp, 0.3_dp, needed))
        if (drawn) words = words // " " // trim(key%name) // "=" // values_of(source, scale, key) // ","
      end associate
    end do
    words = words // " /" // newline
  end function draw_group

  !> So many values as the key takes, four at the most unless it takes more at the least.
  function values_of(source, scale, key) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    type(key_type), intent(in) :: key
    character(len=:), allocatable :: words
    integer :: least, n, i

    least = key%least
    if (key%shorter > 0) least = min(least, key%shorter)
    n = least + source%dice%below(1 + max(0, min(key%most, max(4, least)) - least))
    words = one_value(source, scale, key)
    do i = 2, n
      words = words // "," // one_value(source, scale, key)
    end do
  end function values_of

  function one_value(source, scale, key) result(word)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    type(key_type), intent(in) :: key
    character(len=:), allocatable :: word
    real(dp) :: value

    select case (key%kind)
    case (real_key, integer_key)
      value = number_of(source, scale, key)
      if (key%kind == integer_key) then
        word = whole_word(source, nint(value))
      else
        word = real_word(source, value)
      end if
    case default
      word = name_word(source, text_of(source, scale, key))
    end select
  end function one_value

  !> A number within the range of the key, of the size of its unit on this machine.
  real(dp) function number_of(source, scale, key) result(value)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    type(key_type), intent(in) :: key
    real(dp) :: size

    associate (dice => source%dice, m => scale%mass, l => scale%length)
      if (key%kind == integer_key) then
        value = max(key%range%least, 0.0_dp) + dice%below(4)
        if (key%range%unit_size) value = 1 - 2 * dice%below(2)
        return
      end if
      select case (key%unit)
      case (of_length)
        size = l
      case (of_mass)
        size = m
      case (of_inertia)
        size = m * l**2
      case (of_stiffness)
        size = scale%stiffness
      case (of_force)
        size = scale%stiffness * l
      case (of_moment)
        size = scale%stiffness * l**2
      case (of_damping)
        size = scale%damping
      case (of_rotary_damping)
        size = scale%damping * l**2
      case (of_angle)
        size = 180
      case default
        size = dice%pick_of([1.0_dp, scale%speed, m, l, scale%stiffness])
        if (key%default > unset .and. abs(key%default) > 0 .and. dice%chance(0.5_dp)) size = key%default
      end select
      value = size * dice%decades(-1.0_dp, 1.0_dp)
      if (key%range%least < 0 .and. dice%chance(0.3_dp)) value = -value
      if (dice%chance(0.9_dp)) value = max(key%range%least, min(key%range%most, value))
    end associate
  end function number_of

  !> One of the words that the key may be; else a path, a quantity or a name, as the key's name suggests.
  function text_of(source, scale, key) result(word)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    type(key_type), intent(in) :: key
    character(len=:), allocatable :: word
    character(len=8), parameter :: kinds(*) = [character(len=8) :: "path", "quantity", "name"]
    character(len=:), allocatable :: kind

    if (key%words /= "") then
      word = source%dice%pick(all_words(key%words))
      return
    end if
    kind = source%dice%pick(kinds)
    if (has(key%name, "parameter") .or. key%name == "with") kind = "path"
    if (has(key%name, "quantit") .or. key%name == "columns") kind = "quantity"
    select case (kind)
    case ("path")
      word = parameter_path(source, scale)
    case ("quantity")
      word = quantity_name(source, scale)
    case default
      word = source%dice%pick(["J", "L", "P", "M"]) // text(1 + source%dice%below(4))
    end select
  end function text_of

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

end module fuzz_schema

!> Input files of the machines of the exact population.
module exact_text
  use oracle_machine, only: dp, exact_machine
  implicit none (type, external)
  private

  public :: input_text, brief

  character, parameter :: newline = new_line("a")

contains

  !> The nearest number to x with four digits.
  real(dp) function brief(x)
    real(dp), intent(in) :: x
    character(len=12) :: digits

    write (digits, "(es12.3e3)") x
    read (digits, *) brief
  end function brief

  !> The input file; reading it yields the same numbers.
  function input_text(machine, title, tolerance) result(text)
    type(exact_machine), intent(in) :: machine
    character(len=*), intent(in) :: title
    real(dp), intent(in) :: tolerance
    character(len=:), allocatable :: text
    integer :: k

    text = "&case title='" // title // "', tasks='stability','response','forces','power' /" // newline &
      & // "&drive speed_rpm=" // numbers([machine%speed_rpm]) // ", held_by='" // trim(machine%held_by) // "' /" // newline
    do k = 1, size(machine%joints)
      text = text // joint_text(machine, k) // " /" // newline
    end do
    do k = 1, size(machine%links)
      associate (link => machine%links(k))
        text = text // "&link name='" // name("l", k) // "', from='" // name("j", link%from) // "'"
        if (link%to > 0) text = text // ", to='" // name("j", link%to) // "'"
        text = text // ", mass=" // numbers([link%mass]) // ", inertia=" // numbers([link%inertia]) // ", center=" &
          & // numbers(link%center) // " /" // newline
      end associate
    end do
    text = text // "&frame mass=" // numbers([machine%frame_mass]) // ", inertia=" // numbers([machine%frame_inertia]) &
      & // ", origin=" // numbers(machine%origin)
    if (.not. all(machine%free)) text = text // ", dof=" // free_text(machine%free)
    text = text // " /" // newline
    do k = 1, size(machine%supports)
      associate (support => machine%supports(k))
        text = text // "&support position=" // numbers(support%position) // ", stiffness=" // numbers(support%stiffness) &
          & // ", damping=" // numbers(support%damping) // ", angle=" // numbers([support%angle_deg])
        if (support%turning) text = text // ", axes='frame'"
        text = text // " /" // newline
      end associate
    end do
    text = text // "&foundation stiffness=" // numbers(reshape(machine%foundation_stiffness, [9])) // ", damping=" &
      & // numbers(machine%foundation_damping) // " /" // newline
    if (machine%acceleration > 0) text = text // "&gravity acceleration=" // numbers([machine%acceleration]) // ", direction=" &
      & // numbers([machine%direction_deg]) // " /" // newline
    text = text // "&probe name='p', position=" // numbers(machine%probe) // ", band_hz=" // numbers(machine%band) // " /" &
      & // newline // "&response points=48, harmonics=12 /" // newline // "&accuracy tolerance=" &
      & // numbers([tolerance]) // " /" // newline
  end function input_text

  function joint_text(machine, k) result(text)
    type(exact_machine), intent(in) :: machine
    integer, intent(in) :: k
    character(len=:), allocatable :: text
    character(len=12) :: word
    integer :: n

    associate (joint => machine%joints(k))
      text = "&joint name='" // name("j", k) // "', type='" // trim(joint%kind) // "'"
      select case (joint%kind)
      case ("ground")
        text = text // ", position=" // numbers(joint%position)
      case ("crank")
        text = text // ", pivot='" // name("j", joint%ends(1)) // "', radius=" // numbers([joint%radius]) // ", phase=" &
          & // numbers([joint%phase_deg])
        write (word, "(i0, ',', i0)") machine%turns_of(k), machine%turns
        if (machine%turns_of(k) /= machine%turns) text = text // ", ratio=" // trim(word)
      case ("RRR")
        text = text // ends() // ", lengths=" // numbers(joint%lengths) // branch()
      case ("RRP")
        text = text // ", ends='" // name("j", joint%ends(1)) // "', lengths=" // numbers(joint%lengths(:1)) // branch() &
          & // guide("guide", joint%guide, joint%guide_point, joint%guide_angle_deg)
      case ("RPR")
        text = text // ends() // ", lengths=" // numbers(joint%lengths(:1)) // branch()
      case ("rigid")
        text = text // ends() // ", offset=" // numbers(joint%offset)
      case ("PRP")
        text = text // guide("guide", joint%guide, joint%guide_point, joint%guide_angle_deg) &
          & // guide("guide2", joint%guide2, joint%guide2_point, joint%guide2_angle_deg)
      case ("RPP")
        text = text // ", ends='" // name("j", joint%ends(1)) // "', slot_angle=" // numbers([joint%slot_angle_deg]) &
          & // guide("guide", joint%guide, joint%guide_point, joint%guide_angle_deg)
      case ("cylinder")
        text = text // ", stroke=" // numbers(joint%lift) // ", phase=" // numbers([joint%phase_deg])
        if (joint%ends(1) > 0) then
          text = text // ends() // ", lengths=" // numbers(joint%lengths(:1)) // branch()
        else
          text = text // guide("guide", joint%guide, joint%guide_point, joint%guide_angle_deg)
        end if
      case default ! follower
        n = size(joint%lift)
        text = text // ", cam='" // name("j", joint%ends(1)) // "','" // name("j", joint%ends(2)) // "', lift=" &
          & // numbers(joint%lift(:n)) // ", lift_phase=" // numbers([joint%phase_deg]) &
          & // guide("guide", joint%guide, joint%guide_point, joint%guide_angle_deg)
      end select
    end associate

  contains

    function ends() result(words)
      character(len=:), allocatable :: words

      words = ", ends='" // name("j", machine%joints(k)%ends(1)) // "','" // name("j", machine%joints(k)%ends(2)) // "'"
    end function ends

    function branch() result(words)
      character(len=:), allocatable :: words

      words = ", branch=" // trim(merge("1 ", "-1", machine%joints(k)%branch > 0))
    end function branch

  end function joint_text

  function guide(key, carriers, at, angle) result(text)
    character(len=*), intent(in) :: key
    integer, intent(in) :: carriers(2)
    real(dp), intent(in) :: at(2), angle
    character(len=:), allocatable :: text

    text = ""
    if (carriers(1) > 0) text = ", " // key // "='" // name("j", carriers(1)) // "','" // name("j", carriers(2)) // "'"
    text = text // ", " // key // "_point=" // numbers(at) // ", " // key // "_angle=" // numbers([angle])
  end function guide

  function free_text(free) result(text)
    logical, intent(in) :: free(3)
    character(len=:), allocatable :: text
    character(len=5), parameter :: coordinates(3) = ["'xi' ", "'eta'", "'psi'"]
    integer :: k

    text = ""
    do k = 1, 3
      if (free(k)) text = text // "," // trim(coordinates(k))
    end do
    text = text(2:)
  end function free_text

  !> Names j1, j2, ...
  function name(letter, number)
    character, intent(in) :: letter
    integer, intent(in) :: number
    character(len=:), allocatable :: name
    character(len=4) :: digits

    write (digits, "(i0)") number
    name = letter // trim(digits)
  end function name

  !> A number with four digits if they suffice, otherwise with 17 digits.
  function numbers(values) result(text)
    real(dp), intent(in) :: values(:)
    character(len=:), allocatable :: text
    character(len=26) :: digits
    integer :: k

    text = ""
    do k = 1, size(values)
      if (abs(values(k) - brief(values(k))) > 0) then
        write (digits, "(es25.16e3)") values(k)
      else
        write (digits, "(es12.3e3)") values(k)
      end if
      text = text // "," // trim(adjustl(digits))
    end do
    text = text(2:)
  end function numbers

end module exact_text

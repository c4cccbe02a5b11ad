!> Defines the names of the quantities of a vibration in tables, reports and pictures.
module gestell_task_response_names
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: dof_names
  use gestell_model_space, only: is_rotation
  use gestell_output_table_unit, only: metre, metre_per_s, newton, newton_metre, radian, radian_per_s, unit_type
  implicit none (type, external)
  private

  public :: names_of, peak_heads, peak_units, peak_words

  !> Names and units of one quantity of the vibration in tables, reports and pictures.
  type, public :: name_type
    !> Key of the table column, without the unit (the unit is appended to it)
    character(len=11) :: column = ""
    !> Unit of the table column
    type(unit_type) :: unit
    !> Meaning of the table column in words
    character(len=64) :: meaning = ""
    !> Name of the quantity in the report
    character(len=24) :: words = ""
    !> Unit of the quantity in the report
    character(len=6) :: small_unit = ""
    !> Factor from the value in SI units to the value in the report
    real(dp) :: factor = 1
    !> Symbol of the quantity in pictures
    character(len=10) :: symbol = ""
  end type name_type

  character(len=2), parameter :: forces(6) = [character(len=2) :: "fx", "fy", "m", "fz", "mx", "my"]
  character, parameter :: along(6) = ["x", "y", "z", "z", "x", "y"]
  character(len=9), parameter :: symbols(6) = [character(len=9) :: "ξ", "η", "ψ", "ζ", "rot ξ", "rot η"]

contains

  !> Names of the quantities of a frame with `dofs` degrees of freedom, shape (3 dofs). The order is: degrees of freedom, their
  !> velocities, forces and moments on the ground.
  pure function names_of(dofs) result(names)
    integer, intent(in) :: dofs
    type(name_type) :: names(3 * dofs)
    character(len=:), allocatable :: dof
    integer :: i

    do i = 1, dofs
      dof = trim(dof_names(i))
      associate (q => names(i), v => names(dofs + i), f => names(2 * dofs + i))
        if (is_rotation(i)) then
          q = name_type(dof, radian, "rotation of the frame", dof, "mrad", 1.0e3_dp, symbols(i))
          v = name_type(dof // "_dot", radian_per_s, "angular velocity of the frame", dof // " velocity", "mrad/s", 1.0e3_dp)
          f = name_type(forces(i), newton_metre, "moment on the ground about the rest position of F", "moment on ground", "N m", &
            & 1.0_dp, "moment")
          if (dofs > 3) q%meaning = "component of the frame's rotation vector"
          if (dofs > 3) f%meaning = "moment on the ground about the rest position of F; part about " // along(i)
          if (dofs > 3) f%words = trim(f%words) // ", " // along(i)
          if (dofs > 3) f%symbol = "moment " // along(i)
        else
          q = name_type(dof, metre, "displacement of F from its static position, along " // dof, dof // " of F", "mm", &
            & 1.0e3_dp, symbols(i))
          v = name_type(dof // "_dot", metre_per_s, "velocity of F along " // dof, dof // " velocity", "mm/s", 1.0e3_dp)
          f = name_type(forces(i), newton, "force on the ground along " // along(i), "force on ground, " // along(i), "N", 1.0_dp, &
            & "force " // along(i))
        end if
      end associate
    end do
  end function names_of

  !> Headings of the columns with the peaks of the degrees of freedom. Each heading begins with a comma.
  pure function peak_heads(dofs) result(heads)
    integer, intent(in) :: dofs
    character(len=:), allocatable :: heads
    integer :: i

    heads = ""
    do i = 1, dofs
      heads = heads // ","
      ! with the word "peak", six columns would be too wide
      if (dofs == 3) heads = heads // "peak "
      heads = heads // trim(dof_names(i))
    end do
  end function peak_heads

  !> Units of the peaks of the degrees of freedom in a report. Each unit begins with a comma.
  pure function peak_units(dofs) result(units)
    integer, intent(in) :: dofs
    character(len=:), allocatable :: units
    type(name_type) :: names(3 * dofs)
    integer :: i

    names = names_of(dofs)
    units = ""
    do i = 1, dofs
      units = units // "," // trim(names(i)%small_unit)
    end do
  end function peak_units

  !> Names of all peaks with SI units, for example "peak of xi (m)", "peak of xi' (m/s)" and "peak of fx (N)".
  pure function peak_words(dofs) result(words)
    integer, intent(in) :: dofs
    character(len=24) :: words(3 * dofs)
    type(name_type) :: names(3 * dofs)
    integer :: i

    names = names_of(dofs)
    do i = 1, dofs
      words(i) = "peak of " // trim(dof_names(i)) // " (" // trim(names(i)%unit%words) // ")"
      words(dofs + i) = "peak of " // trim(dof_names(i)) // "' (" // trim(names(dofs + i)%unit%words) // ")"
      words(2 * dofs + i) = "peak of " // trim(forces(i)) // " (" // trim(names(2 * dofs + i)%unit%words) // ")"
    end do
  end function peak_words

end module gestell_task_response_names

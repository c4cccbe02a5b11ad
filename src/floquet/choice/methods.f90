!> Creates integration methods by name.
module gestell_floquet_choice_methods
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_floquet_integrator_comparison_cooper_verner, only: cooper_verner
  use gestell_floquet_integrator_gauss, only: gauss
  use gestell_floquet_integrator_comparison_magnus, only: magnus
  use gestell_floquet_integrator_method, only: method_type, name_length
  use gestell_floquet_integrator_comparison_runge_kutta, only: runge_kutta
  implicit none (type, external)
  private

  public :: find_method, method_names, new_method, stages_of

  !> A method is assumed to converge as soon as two solutions with different numbers of steps differ by less than this fraction
  !> of their size.
  real(dp), parameter, public :: begun = 0.01_dp
  !> A method with embedded methods is assumed to converge as soon as the results of its first and its second embedded method
  !> differ by less than this fraction of their size.
  real(dp), parameter, public :: pair_begun = 3 * begun

contains

  !> Names of all integration methods that `new_method` accepts.
  pure function method_names() result(names)
    character(len=name_length), allocatable :: names(:)

    names = [character(len=name_length) :: "auto", "rk4", "explicit8", "magnus4", "magnus6", "gauss2", "gauss3", "gauss4", &
      & "gauss5", "gauss6", "gauss7", "gauss8", "gauss9", "gauss10"]
  end function method_names

  !> Creates the integration method with the given name and computes its coefficients. The name `auto` gives gauss6, which suits
  !> most systems. Fails if the name is unknown.
  subroutine new_method(name, method, error)
    character(len=*), intent(in) :: name
    class(method_type), allocatable, intent(out) :: method
    type(error_type), allocatable, intent(out) :: error

    call find_method(name, method, error)
    if (allocated(method)) call method%prepare()
  end subroutine new_method

  !> Creates the integration method with the given name, without computing its coefficients. Fails if the name is unknown.
  subroutine find_method(name, method, error)
    character(len=*), intent(in) :: name
    class(method_type), allocatable, intent(out) :: method
    type(error_type), allocatable, intent(out) :: error

    select case (name)
    case ("auto")
      method = gauss(6)
    case ("rk4")
      method = runge_kutta()
    case ("explicit8")
      method = cooper_verner()
    case ("magnus4", "magnus6")
      method = magnus(iachar(name(7:7)) - iachar("0"))
    case ("gauss2", "gauss3", "gauss4", "gauss5", "gauss6", "gauss7", "gauss8", "gauss9", "gauss10")
      method = gauss(stages_of(name))
    case default
      call fatal_error(error, "unknown integration method '" // name // "'", invalid_input)
    end select
  end subroutine find_method

  !> Number of stages of the Gauss method with the given name.
  pure integer function stages_of(name)
    character(len=*), intent(in) :: name

    stages_of = iachar(name(6:6)) - iachar("0")
    if (len_trim(name) > 6) stages_of = 10 * stages_of + iachar(name(7:7)) - iachar("0")
  end function stages_of

end module gestell_floquet_choice_methods

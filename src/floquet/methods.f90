!> The methods by name.
module gestell_floquet_methods
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_floquet_gauss, only: gauss
  use gestell_floquet_method, only: method_type
  use gestell_floquet_runge_kutta, only: runge_kutta
  implicit none (type, external)
  private

  public :: method_names, new_method

contains

  !> All names that `new_method` knows.
  pure function method_names() result(names)
    character(len=6), allocatable :: names(:)

    names = [character(len=6) :: "auto", "rk4", "gauss2", "gauss3", "gauss4", "gauss5", "gauss6", "gauss7", "gauss8"]
  end function method_names

  !> The method of that name; `auto` is gauss6, the cheapest of the family over the common range of tolerances.
  subroutine new_method(name, method, error)
    character(len=*), intent(in) :: name
    class(method_type), allocatable, intent(out) :: method
    type(error_type), allocatable, intent(out) :: error

    select case (name)
    case ("auto")
      method = gauss(6)
    case ("rk4")
      method = runge_kutta()
    case ("gauss2", "gauss3", "gauss4", "gauss5", "gauss6", "gauss7", "gauss8")
      method = gauss(iachar(name(6:6)) - iachar("0"))
    case default
      call fatal_error(error, "unknown method '" // name // "'", invalid_input)
    end select
  end subroutine new_method

end module gestell_floquet_methods

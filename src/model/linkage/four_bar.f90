!> Parts of the diagnosis of a linkage that depend on the types of its joints: shafts, and Grashof's class of a four-bar.
submodule (gestell_model_linkage_diagnosis) gestell_model_linkage_four_bar
use gestell_model_joints_types_crank, only: crank_joint
use gestell_model_joints_types_ground, only: ground_joint
use gestell_model_joints_types_rrr, only: rrr_joint
implicit none (type, external)

contains

  module procedure shaft_of
    select type (pin => linkage%joints(i)%joint)
    class is (crank_joint)
      do first = 1, i - 1
        select type (other => linkage%joints(first)%joint)
        class is (crank_joint)
          associate (one => at(pin%pivot), two => at(other%pivot))
            if (.not. abs(one%x%v - two%x%v) + abs(one%y%v - two%y%v) > 0 .and. other%ratio == pin%ratio) return
          end associate
        end select
      end do
    end select
    first = 0
  end procedure shaft_of

  module procedure grashof_class
    type(point_type) :: at(size(linkage%joints))
    type(form_type) :: form
    real(dp) :: lengths(4)
    integer :: i, crank, dyad, other

    grashof_class = ""
    crank = 0
    dyad = 0
    do i = 1, size(linkage%joints)
      call linkage%joints(i)%joint%describe(form)
      if (form%links == 0) cycle
      select type (joint => linkage%joints(i)%joint)
      class is (crank_joint)
        if (crank > 0) return
        crank = i
      class is (rrr_joint)
        if (dyad > 0) return
        dyad = i
      class default
        return
      end select
    end do
    if (dyad == 0) return
    select type (joint => linkage%joints(dyad)%joint)
    class is (rrr_joint)
      if (.not. any(joint%ends == crank)) return
      other = sum(joint%ends) - crank
      lengths(2) = joint%lengths(findloc(joint%ends, crank, dim=1))
      lengths(3) = joint%lengths(findloc(joint%ends, other, dim=1))
    end select
    select type (joint => linkage%joints(other)%joint)
    class is (ground_joint)
    class default
      return
    end select
    call linkage%points(0.0_dp, at)
    select type (joint => linkage%joints(crank)%joint)
    class is (crank_joint)
      lengths(1) = joint%radius
      lengths(4) = hypot(at(other)%x%v - at(joint%pivot)%x%v, at(other)%y%v - at(joint%pivot)%y%v)
    end select
    select case (minloc(lengths, dim=1))
    case (1)
      grashof_class = "crank-rocker (shortest link: crank)"
    case (4)
      grashof_class = "double crank (shortest link: frame)"
    case default ! the class has no name
    end select
  end procedure grashof_class

end submodule gestell_model_linkage_four_bar

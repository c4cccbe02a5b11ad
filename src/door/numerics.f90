!> Old name of `gestell_api_numerics`. It works until version 2.0.0.
module gestell_door_numerics
  use gestell_api_numerics
  implicit none (type, external)
  public
end module gestell_door_numerics

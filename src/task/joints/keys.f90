!> Defines the keys of the input group &joints.
module gestell_task_joints_keys
  use gestell_base_key, only: key_type, text_key
  implicit none (type, external)
  private

  type(key_type), parameter, public :: joints_keys(*) = [ &
    & key_type("joints", "on", text_key, "state of the frame: `mounts`: it vibrates on its mounts; `rigid`: it is at rest", &
    &   word="mounts", words="mounts, rigid"), &
    & key_type("joints", "axes", text_key, "components of the forces in `joints.csv`, `joints_harmonics.csv` and the report: " // &
    &   "along the axes of the mechanism, or along each link and perpendicular to it", word="mechanism", words="mechanism, link"), &
    & key_type("joints", "names", text_key, "joints to report", 1, 1, 100, otherwise="all joints")]

end module gestell_task_joints_keys

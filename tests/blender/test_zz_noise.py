import math, numpy as np, bpy, pytest
import sys, pathlib; sys.path.insert(0, str(pathlib.Path(__file__).parent))
from test_blender_cycles import stage, SCENES  # noqa
@pytest.mark.parametrize("kind",["world","moving under a world"])
def test_noise(stage, tmp_path, kind):
    from peer import render_cycles
    SCENES[kind](); c=stage.adaptive_drt; c.method="EXACT"; bpy.ops.adaptive_drt.render()
    image=bpy.data.images["Adaptive Render"]; flat=np.empty(len(image.pixels),dtype=np.float32); image.pixels.foreach_get(flat)
    ours=flat.reshape(image.size[1],image.size[0],4)[...,:3]
    a,b=(render_cycles(tmp_path,seed=s) for s in (1,2))
    m=a.mean(); r=lambda x: math.sqrt((x**2).mean())/m
    print("FIG",kind,"seed1-seed2/sqrt2",r(a-b)/2**.5,"ours-seed1",r(ours-a),"ours-mean of two",r(ours-(a+b)/2),"means",ours.mean()/((a+b)/2).mean()-1)

"""prototype policy"""
from __future__ import annotations
from collections.abc import Callable
from dataclasses import dataclass, replace
import numpy as np
from numpy.typing import NDArray
from heartgen.mesh.biventricular import right_apex
from heartgen.mesh.freedom import FaceFreedom, Freedom
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.validity import certify
from heartgen.refinement.assembly import Assembler
from heartgen.refinement.distances import MeshToPatient, PatientToMesh, misfit
from heartgen.refinement.gauss_newton import minimize
from heartgen.refinement.lines import FairLines
from heartgen.refinement.quality import EvenJacobians, RightAngles
from heartgen.refinement.target import CUTS, FitTarget

@dataclass(frozen=True)
class FitSettings:
    distance: float = 0.3      # voxels that weigh one unit
    even: float = 70.
    angle: float = 6.25
    fair: float = 3.
    normal: float = 0.05
    movement: float = 0.5      # per (length/38)^2
    cut: float = 5.
    apex: float = 3.
    right_apex: float = 1.
    steps: int = 10
    rounds: int = 8
    growth: float = 2.
    more_steps: int = 10
    along: float = 0.
    cross: float = 1.
    keep: tuple = (1.,1.,1.)
    debug: bool = False

def optimize(mesh, target, settings, allowed=np.inf, least=0., progress=lambda d: None, reference=None):
    s=settings
    freedom=Freedom(mesh.topology); faces=FaceFreedom(freedom, mesh.topology)
    assembler=Assembler([freedom.dofs, faces.dofs], freedom.n)
    e=mesh.n_elements; f=len(faces.faces); of=faces.faces[:,0]
    fw=np.ones(f); cut=np.zeros(f,bool)
    for n in CUTS: cut[faces.rows.get(n,slice(0))]=True
    per=1/(s.distance*target.voxel)**2
    dist=np.ones(e); dist[right_apex(mesh.topology)]*=s.right_apex; dist[mesh.topology.index[:,2]==0]*=s.apex
    dist=per*dist[of]; out=np.where(cut,s.cut*dist,dist)
    wall=(~cut)/ (~cut).sum()
    per_move=s.movement*(38/target.length)**2
    free=np.isin(of, mesh.topology.parts.get("right ventricle", []))
    q0=mesh.dofs[freedom.free]; ref=faces.at(q0 if reference is None else reference.dofs[freedom.free])
    weight=np.ones(e); factor=1.
    q=q0; best=None; valid=False; history=[]
    shape=lambda q: mesh.with_dofs(np.asarray(freedom.straight@q))
    ok=lambda q: certify(shape(q)).all_valid
    for r in range(s.rounds):
        w=factor*weight
        terms=[MeshToPatient(faces,target,out),PatientToMesh(faces,target,dist),
          EvenJacobians(freedom,mesh.topology,s.even*w/e),RightAngles(freedom,s.angle*w/e),
          FairLines(faces,ref,s.fair*w[of]*wall,s.normal*w[of]*wall,per_move*np.where(free,0,1)*w[of]*wall,s.along,s.cross,s.keep)]
        if s.debug: E0=[t.near(q).value(q) for t in terms]
        q=minimize(q,terms,assembler,s.steps if r==0 else s.more_steps, ok if valid else (lambda q: True))
        if s.debug: E1=[t.near(q).value(q) for t in terms]; print('  E',np.round(E0,3),'->',np.round(E1,3))
        m=shape(q); folded=~certify(m).valid
        mf=misfit(m,target) if np.isfinite(allowed) else 0
        if s.debug: print(f'  round {r}: folded {folded.sum()} cross {certify(m).overlapping.sum()} {[tuple(int(i) for i in x) for x in mesh.topology.index[folded]][:6]} misfit {mf:.4f} allowed {allowed:.4f} factor {factor:.2f} wmax {weight.max():.0f}')
        if folded.any():
            weight=weight*np.where(folded, s.growth*(r+1), 1)
            continue
        if not valid:
            valid=True
            if weight.max()>s.growth:
                weight=np.where(weight>1,s.growth,1.); best=m; continue
        best=m
        if mf<=allowed or r==s.rounds-1: break
        factor*=max(.5,(.995*allowed/mf)**7)
    return (best if valid else m), int((weight>1).sum()), valid

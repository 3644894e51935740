"""Writes the files of `tests/foreign.rs` with the libraries of the programs whose formats they have.

pip install rosbags mcap mcap-ros2-support pyxdf h5py numpy scipy
python write.py .
"""
import pathlib
import struct
import sys

import h5py
import numpy as np
from rosbags.rosbag2 import Writer as W2, StoragePlugin
from rosbags.rosbag1 import Writer as W1
from rosbags.typesys import Stores, get_typestore, get_types_from_msg
out = pathlib.Path(sys.argv[1]); out.mkdir(parents=True, exist_ok=True)
N=40
t0=1_700_000_000_000_000_000
stamps=[t0+i*10_000_000+ (i%3)*1000 for i in range(N)]
f=np.array([[np.sin(i/9),np.cos(i/7),i*0.25] for i in range(N)])
ts=get_typestore(Stores.ROS2_HUMBLE)
ts.register(get_types_from_msg("std_msgs/Header header\nuint8 kind\nfloat32[4] cells\nuint16[<=8] raw\ngeometry_msgs/Vector3[2] forces\nbool on\nint64 ticks\nstring<=10 note\n","lab_msgs/msg/Skin"))
T=ts.types
def header(i): return T['std_msgs/msg/Header'](stamp=T['builtin_interfaces/msg/Time'](sec=stamps[i]//10**9,nanosec=stamps[i]%10**9),frame_id='x'*(i%5))
V=T['geometry_msgs/msg/Vector3']
def wrench(i): return T['geometry_msgs/msg/WrenchStamped'](header=header(i),wrench=T['geometry_msgs/msg/Wrench'](force=V(*f[i]),torque=V(0.1,0.2,0.3)))
def skin(i): return T['lab_msgs/msg/Skin'](header=header(i),kind=3,cells=np.array([i,1,2,3],dtype=np.float32),raw=np.array([i,i+1,7],dtype=np.uint16),forces=[V(*f[i]),V(1.,2.,3.)],on=True,ticks=-i,note='a'*(i%7))
def multi(i):
    D=T['std_msgs/msg/MultiArrayDimension']; L=T['std_msgs/msg/MultiArrayLayout']
    return T['std_msgs/msg/Float32MultiArray'](layout=L(dim=[D(label='rows',size=2,stride=6),D(label='cols',size=3,stride=3)],data_offset=0),data=np.arange(6,dtype=np.float32)+i)
def joint(i): return T['sensor_msgs/msg/JointState'](header=header(i),name=['a','b'],position=np.array([i,2.]),velocity=np.array([]),effort=np.array([0.5,i/2]))
def image(i): return T['sensor_msgs/msg/Image'](header=header(i),height=3,width=4,encoding='mono16',is_bigendian=0,step=10,data=np.frombuffer(b''.join(struct.pack('<4H',*[i+r*4+c for c in range(4)])+b'zz' for r in range(3)),dtype=np.uint8))
def points(i):
    F=T['sensor_msgs/msg/PointField']
    data=b''.join(struct.pack('<fHxxff',c*0.5,i,r,i+10*r+c) for r in range(2) for c in range(3))
    return T['sensor_msgs/msg/PointCloud2'](header=header(i),height=2,width=3,fields=[F(name='x',offset=0,datatype=7,count=1),F(name='n',offset=4,datatype=4,count=1),F(name='f',offset=8,datatype=7,count=2)],is_bigendian=False,point_step=16,row_step=48,data=np.frombuffer(data,dtype=np.uint8),is_dense=True)
def text(i): return T['std_msgs/msg/String'](data='hello')
topics=[('/wrench','geometry_msgs/msg/WrenchStamped',wrench),('/skin','lab_msgs/msg/Skin',skin),('/multi','std_msgs/msg/Float32MultiArray',multi),('/joints','sensor_msgs/msg/JointState',joint),('/image','sensor_msgs/msg/Image',image),('/text','std_msgs/msg/String',text)]
def rosbag2(name, plugin, version, compression=None, comp_format=None, only=None):
    p=out/name
    w=W2(p,version=version,storage_plugin=plugin)
    if compression: w.set_compression(compression, comp_format)
    with w:
        conns=[(w.add_connection(n,k,typestore=ts),m,k) for n,k,m in topics if only is None or n in only]
        for i in range(N):
            for c,m,k in conns: w.write(c,stamps[i]+500,ts.serialize_cdr(m(i),k))
rosbag2('bag_sqlite',StoragePlugin.SQLITE3,9)
rosbag2('bag_sqlite_old',StoragePlugin.SQLITE3,8,only=['/wrench','/multi','/skin'])
rosbag2('bag_mcap',StoragePlugin.MCAP,9)
rosbag2('bag_one',StoragePlugin.MCAP,9,only=['/wrench'])
topics=[('/points','sensor_msgs/msg/PointCloud2',points)]
rosbag2('bag_points',StoragePlugin.MCAP,9)
rosbag2('bag_points_old',StoragePlugin.SQLITE3,8)
# mcap by the mcap library, compressions
from mcap_ros2.writer import Writer as MW
from mcap.writer import Writer as RawW, CompressionType
for comp in [CompressionType.NONE,CompressionType.LZ4,CompressionType.ZSTD]:
    with open(out/f'lib_{comp.name.lower()}.mcap','wb') as s:
        w=RawW(s,compression=comp,chunk_size=1500); w.start('ros2','other')
        sid=w.register_schema('geometry_msgs/msg/WrenchStamped','ros2msg',ts.generate_msgdef('geometry_msgs/msg/WrenchStamped')[0].encode())
        cid=w.register_channel('/wrench','cdr',sid)
        j=w.register_schema('x','jsonschema',b'{}'); jc=w.register_channel('/json','json',j)
        for i in range(N):
            w.add_message(cid,stamps[i]+500,ts.serialize_cdr(wrench(i),'geometry_msgs/msg/WrenchStamped'),stamps[i])
            w.add_message(jc,stamps[i]+500,b'{}',stamps[i])
        w.finish()
# ros1
ts1=get_typestore(Stores.ROS1_NOETIC)
T1=ts1.types
for comp in [None,W1.CompressionFormat.LZ4,W1.CompressionFormat.BZ2]:
    w=W1(out/f'ros1_{comp.name.lower() if comp else "none"}.bag')
    if comp: w.set_compression(comp)
    with w:
        c=w.add_connection('/wrench','geometry_msgs/msg/WrenchStamped',typestore=ts1)
        for i in range(N):
            V1=T1['geometry_msgs/msg/Vector3']
            m=T1['geometry_msgs/msg/WrenchStamped'](header=T1['std_msgs/msg/Header'](seq=i,stamp=T1['builtin_interfaces/msg/Time'](sec=stamps[i]//10**9,nanosec=stamps[i]%10**9),frame_id='y'),wrench=T1['geometry_msgs/msg/Wrench'](force=V1(*f[i]),torque=V1(0.1,0.2,0.3)))
            w.write(c,stamps[i]+500,ts1.serialize_ros1(m,'geometry_msgs/msg/WrenchStamped'))
# numpy
t=np.arange(N)*0.01
maps=np.arange(N*12,dtype=np.float32).reshape(N,3,4)
np.save(out/'plain.npy',np.column_stack([t,f]))
np.save(out/'fortran.npy',np.asfortranarray(np.column_stack([t,f])))
np.save(out/'big.npy',np.column_stack([t,f]).astype('>f4'))
rec=np.zeros(N,dtype=[('t','<u8'),('p','<f4',(4,)),('label','<U8'),('n','<i2')])
rec['t']=np.array(stamps)//1000; rec['p']=np.arange(N*4).reshape(N,4); rec['n']=np.arange(N)-5
np.save(out/'struct.npy',rec)
np.savez(out/'maps.npz',t=t,maps=maps,note=np.array('x'))
np.savez_compressed(out/'maps_z.npz',t=t,maps=maps)
np.savez(out/'series.npz',time_ms=(t*1000),fx=f[:,0],fy=f[:,1])
np.savez(out/'two.npz',t=t,left=maps,right=maps*2)
# hdf5
for lib in ['earliest','latest']:
    with h5py.File(out/f'maps_{lib}.h5','w',libver=lib) as h:
        h['t']=t; g=h.create_group('skin')
        g.create_dataset('map',data=maps,chunks=(7,2,3),compression='gzip',shuffle=True,fletcher32=True)
        h['who']='text'
with h5py.File(out/'plain.h5','w') as h:
    h['log/time']=np.array(stamps)/1e9; h['log/force']=f
with h5py.File(out/'compound.h5','w') as h: h['table']=rec[['t','p','n']]
with h5py.File(out/'series.h5','w',track_order=True) as h:
    for k in range(3): h[f'f{k}']=f[:,k]
    h['time']=t
with h5py.File(out/'userblock.mat','w',userblock_size=512) as h: h['time']=t; h['force']=f
with h5py.File(out/'lzf.h5','w') as h: h['t']=t; h.create_dataset('map',data=maps,compression='lzf')
with h5py.File(out/'grow.h5','w') as h:
    d=h.create_dataset('v',shape=(0,5),maxshape=(None,5),chunks=(16,5),dtype='i2'); d.resize((N,5)); d[:]=np.arange(N*5).reshape(N,5); h['stamp']=np.array(stamps,dtype='u8')
with h5py.File(out/'latest.h5','w',libver='latest') as h:
    h['t']=t
    # An array of addresses in pages, one that grows in blocks, and one without filters.
    h.create_dataset('pages',data=np.arange(1100).reshape(1100,1),chunks=(1,1),dtype='i2',compression='gzip')
    d=h.create_dataset('grow',shape=(0,3),maxshape=(None,3),chunks=(2,2),dtype='i2'); d.resize((600,3)); d[:]=np.arange(1800).reshape(600,3)
    h.create_dataset('plain',data=maps,chunks=(7,2,3))
    h.create_dataset('both',shape=(4,3),maxshape=(None,None),chunks=(2,2),dtype='i2')
# matlab
import scipy.io
for name,packed in [('v5.mat',False),('v7.mat',True)]:
    scipy.io.savemat(out/name,{'t':t,'maps':maps,'small':np.arange(N*2).reshape(N,2)%200,'name':'skin','cells':np.array([1,'x'],dtype=object),'z':np.array([1j])},do_compression=packed)
# The records of MATLAB 4 by its published description; scipy reads them for comparison.
scipy.io.savemat(out/'v4.mat',{'t':t,'small':np.arange(N*2).reshape(N,2)*1.5,'name':'skin','z':np.array([1j])},format='4')
small4=np.arange(N*2,dtype='>i2').reshape(N,2)
(out/'v4_big.mat').write_bytes(b''.join(struct.pack('>5i',1000+p,*a.shape,0,len(n)+1)+n.encode()+b'\0'+a.astype('>'+k).tobytes('F') for n,p,k,a in [('t',0,'f8',t[:,None]),('small',30,'i2',small4)]))
assert (scipy.io.loadmat(out/'v4_big.mat')['small']==small4).all()
# xdf
def chunk(tag,body):
    n=len(body)+2
    head=struct.pack('<BI',4,n) if n>255 else struct.pack('<BB',1,n)
    return head+struct.pack('<H',tag)+body
x=b'XDF:'+chunk(1,b'<?xml version="1.0"?><info><version>1.0</version></info>')
def shead(id,name,typ,n,rate,fmt,labels=()):
    ch=''.join(f'<channel><label>{l}</label><unit>{u}</unit></channel>' for l,u in labels)
    return chunk(2,struct.pack('<I',id)+f'<?xml version="1.0"?><info><name>{name}</name><type>{typ}</type><channel_count>{n}</channel_count><nominal_srate>{rate}</nominal_srate><channel_format>{fmt}</channel_format><created_at>1</created_at><desc><channels>{ch}</channels></desc></info>'.encode())
x+=shead(1,'Force','Force',3,100,'float32',[('fx','N'),('fy','N'),('fz','N')])+shead(2,'Marks','Markers',1,0,'string')+shead(3,'Counts','Raw',2,0,'int16')
lt=[5000+i*0.01 for i in range(N)]
for k in range(0,N,20):
    b=struct.pack('<I',1)+struct.pack('<BB',1,20)
    for i in range(k,k+20):
        b+= (struct.pack('<Bd',8,lt[i]) if i%20==0 else b'\0')+struct.pack('<3f',*f[i])
    x+=chunk(3,b)
    x+=chunk(4,struct.pack('<Idd',1,lt[k],-12.5+1e-5*(lt[k]-5000)))
    x+=chunk(3,struct.pack('<I',2)+struct.pack('<BB',1,1)+struct.pack('<Bd',8,lt[k])+struct.pack('<BB',1,5)+b'touch')
    x+=chunk(3,struct.pack('<I',3)+struct.pack('<BI',4,1)+struct.pack('<Bd2h',8,lt[k]+0.001,k,-k))
    x+=chunk(5,b'\x43\xa5\x46\xdc\xcb\xf5\x41\x0f\xb3\x0e\xd5\x46\x73\x83\xcb\xe4')
x+=chunk(6,struct.pack('<I',1)+b'<info></info>')
(out/'lab.xdf').write_bytes(x)
import pyxdf
streams,_=pyxdf.load_xdf(str(out/'lab.xdf'),dejitter_timestamps=False)
s=[s for s in streams if s['info']['name'][0]=='Force'][0]
np.savetxt(out/'lab_expected.csv',np.column_stack([s['time_stamps'],s['time_series']]),delimiter=',')

<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22" styleCategories="Symbology">
<renderer-v2 type="categorizedSymbol" attr="ending">
<categories>
<category value="rest" symbol="0" label="at rest" render="true"/>
<category value="left" symbol="1" label="left the terrain" render="true"/>
<category value="" symbol="2" label="other" render="true"/>
</categories>
<symbols>
<symbol type="marker" name="0">
<layer class="SimpleMarker"><prop k="name" v="circle"/><prop k="color" v="0,90,160,255"/><prop k="outline_color" v="255,255,255,255"/><prop k="size" v="1.8"/></layer>
</symbol>
<symbol type="marker" name="1">
<layer class="SimpleMarker"><prop k="name" v="triangle"/><prop k="color" v="230,159,0,255"/><prop k="outline_color" v="0,0,0,255"/><prop k="size" v="2.6"/></layer>
</symbol>
<symbol type="marker" name="2">
<layer class="SimpleMarker"><prop k="name" v="cross2"/><prop k="color" v="0,0,0,255"/><prop k="outline_color" v="0,0,0,255"/><prop k="size" v="2.6"/></layer>
</symbol>
</symbols>
</renderer-v2>
</qgis>

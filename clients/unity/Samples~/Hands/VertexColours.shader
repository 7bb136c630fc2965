// Vertex colours, lighter where the surface faces up. For the built-in pipeline, and as an unlit pass in URP.
Shader "Papilla/Vertex colours"
{
    Properties { _Color ("Colour", Color) = (1, 1, 1, 1) }
    SubShader
    {
        Tags { "RenderType" = "Opaque" }
        // The skin is open towards the nail: from above one sees its inside.
        Cull Off
        Pass
        {
            CGPROGRAM
            #pragma vertex vert
            #pragma fragment frag
            #pragma multi_compile_instancing
            #include "UnityCG.cginc"

            fixed4 _Color;

            struct appdata
            {
                float4 vertex : POSITION;
                float3 normal : NORMAL;
                fixed4 colour : COLOR;
                UNITY_VERTEX_INPUT_INSTANCE_ID
            };

            struct v2f
            {
                float4 vertex : SV_POSITION;
                fixed4 colour : COLOR;
                UNITY_VERTEX_OUTPUT_STEREO
            };

            v2f vert(appdata v)
            {
                v2f o;
                UNITY_SETUP_INSTANCE_ID(v);
                UNITY_INITIALIZE_OUTPUT(v2f, o);
                UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(o);
                o.vertex = UnityObjectToClipPos(v.vertex);
                float up = UnityObjectToWorldNormal(v.normal).y;
                o.colour = v.colour * _Color * (0.8 + 0.2 * up);
                return o;
            }

            fixed4 frag(v2f i) : SV_Target
            {
                return fixed4(i.colour.rgb, 1);
            }
            ENDCG
        }
    }
}
